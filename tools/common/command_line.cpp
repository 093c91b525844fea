#include "tools/common/command_line.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "tools/common/exit_status.hpp"

namespace bevel::tools {

struct CommandLine::Impl {
  Impl(const std::string& program, const std::string& description) : app(description, program) {}
  CLI::App app;
  std::vector<std::function<std::string()>> checks;
};

CommandLine::CommandLine(const std::string& program, const std::string& description)
    : impl_(std::make_unique<Impl>(program, description)) {
  impl_->app.set_version_flag("--version", program + " " + BEVEL_VERSION);
}

CommandLine::~CommandLine() = default;

CommandLine& CommandLine::option(const std::string& names, std::string& value, const std::string& help, bool required) {
  CLI::Option* option = impl_->app.add_option(names, value, help)->required(required);
  if (!value.empty()) option->capture_default_str();
  return *this;
}

CommandLine& CommandLine::option(const std::string& names, double& value, const std::string& help, double lowest,
                                 double highest) {
  impl_->app.add_option(names, value, help)->check(CLI::Range(lowest, highest))->capture_default_str();
  return *this;
}

CommandLine& CommandLine::option(const std::string& names, int& value, const std::string& help, int lowest,
                                 int highest) {
  impl_->app.add_option(names, value, help)->check(CLI::Range(lowest, highest))->capture_default_str();
  return *this;
}

CommandLine& CommandLine::positive(const std::string& names, double& value, const std::string& help) {
  impl_->app.add_option(names, value, help)->check(CLI::PositiveNumber);
  return *this;
}

CommandLine& CommandLine::non_negative(const std::string& names, double& value, const std::string& help) {
  impl_->app.add_option(names, value, help)->check(CLI::NonNegativeNumber);
  return *this;
}

CommandLine& CommandLine::numbers(const std::string& names, std::vector<double>& value, const std::string& help,
                                  int count) {
  impl_->app.add_option(names, value, help)->delimiter(',')->expected(count)->capture_default_str();
  return *this;
}

CommandLine& CommandLine::choice(const std::string& names, std::string& value, const std::string& help,
                                 const std::vector<std::string>& allowed) {
  impl_->app.add_option(names, value, help)->check(CLI::IsMember(allowed));
  return *this;
}

CommandLine& CommandLine::paths(const std::string& names, std::vector<std::string>& values, const std::string& help) {
  impl_->app.add_option(names, values, help)->expected(1, CLI::detail::expected_max_vector_size)->type_name("PATH");
  return *this;
}

CommandLine& CommandLine::check(std::function<std::string()> problem) {
  impl_->checks.push_back(std::move(problem));
  return *this;
}

CommandLine& CommandLine::flag(const std::string& names, bool& value, const std::string& help) {
  impl_->app.add_flag(names, value, help);
  return *this;
}

CommandLine& CommandLine::reads_recordings() {
  impl_->app.footer("Exit status: 0 ok, 1 failed, 2 usage, 3 done, but the input was damaged (said on stderr).");
  return *this;
}

CommandLine& CommandLine::arguments(const std::string& name, std::vector<std::string>& values, const std::string& help,
                                    bool required) {
  impl_->app.add_option(name, values, help)->required(required);
  return *this;
}

int CommandLine::run(int argc, char** argv, const std::function<int()>& body) {
  try {
    impl_->app.parse(argc, argv);
    for (const auto& check : impl_->checks)
      if (const std::string problem = check(); !problem.empty()) throw CLI::ValidationError(problem);
  } catch (const CLI::ParseError& e) {
    return impl_->app.exit(e) == 0 ? kOk : kUsage;
  }
  try {
    return body();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", impl_->app.get_name().c_str(), e.what());
    return kFailed;
  }
}

}  // namespace bevel::tools
