// SPDX-License-Identifier: MIT
#include <bevel/cli/command_line.hpp>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <new>

#include <bevel/cli/exit_status.hpp>
#include <bevel/cli/limits.hpp>
#include <bevel/io/config.hpp>

namespace bevel::cli {

struct CommandLine::Impl {
  Impl(const std::string& program, const std::string& description) : app(description, program) {}
  CLI::App app;
  std::vector<std::function<std::string()>> checks;
  std::string example, statuses = "Exit status: 0 ok, 1 failed, 2 usage";
};

namespace {

// "" if every argument that looks like an option is one.
std::string unknown_option(const CLI::App& app, int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--") break;
    if (argument.size() < 2 || argument[0] != '-') continue;
    const bool is_long = argument[1] == '-';
    // -4,10,95 is a value
    if (!is_long && (std::isdigit(static_cast<unsigned char>(argument[1])) != 0 || argument[1] == '.')) continue;
    // -qm FILE is -q -m FILE
    const std::string given = is_long ? argument.substr(0, argument.find('=')) : argument.substr(0, 2);
    std::vector<std::string> known;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
      for (const std::string& name : option->get_snames()) known.push_back("-" + name);
    }
    if (std::ranges::find(known, given) != known.end()) continue;
    const std::string nearest = io::nearest_name(given, known);
    const bool likely = is_long && io::edit_distance(given, nearest) <= (given.size() - 2) / 2;
    return "unknown option " + given + (likely ? "; did you mean " + nearest + "?" : "");
  }
  return "";
}

/// Returns \p status, or kFailed if standard output could not be written completely: on a full disk, the last part of
/// it is refused only when it is flushed.
int status_with_output(const std::string& program, int status) {
  errno = 0;
  std::cout.flush();
  const bool is_flushed = std::fflush(stdout) == 0;
  if (is_flushed && !std::cout.bad() && std::ferror(stdout) == 0) return status;
  const std::string reason = errno != 0 ? std::strerror(errno) : "an earlier write failed";
  std::fprintf(stderr, "%s: standard output cannot be written (%s); free space or redirect it to another place\n",
               program.c_str(), reason.c_str());
  return status == kOk || status == kDamagedInput ? kFailed : status;
}

}  // namespace

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
  return exit_status("3 done, but the input was damaged (said on stderr)");
}

CommandLine& CommandLine::exit_status(const std::string& status) {
  impl_->statuses += ", " + status;
  return *this;
}

CommandLine& CommandLine::example(const std::string& command) {
  impl_->example = "Example: " + command + "\n";
  return *this;
}

CommandLine& CommandLine::arguments(const std::string& name, std::vector<std::string>& values, const std::string& help,
                                    bool required) {
  impl_->app.add_option(name, values, help)->required(required);
  return *this;
}

int CommandLine::run(int argc, char** argv, const std::function<int()>& body) {
  impl_->app.footer(impl_->example + impl_->statuses + ".\n");
  if (const std::string unknown = unknown_option(impl_->app, argc, argv); !unknown.empty()) {
    std::fprintf(stderr, "%s\nRun with --help for more information.\n", unknown.c_str());
    return kUsage;
  }
  try {
    impl_->app.parse(argc, argv);
    for (const auto& check : impl_->checks)
      if (const std::string problem = check(); !problem.empty()) throw CLI::ValidationError(problem);
  } catch (const CLI::ParseError& e) {
    return impl_->app.exit(e) == 0 ? status_with_output(impl_->app.get_name(), kOk) : kUsage;
  }
  try {
    require_limits();
    return status_with_output(impl_->app.get_name(), body());
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "%s: out of memory; raise the limit of address space (ulimit -v unlimited) or free memory\n",
                 impl_->app.get_name().c_str());
    return kFailed;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", impl_->app.get_name().c_str(), e.what());
    return kFailed;
  }
}

}  // namespace bevel::cli
