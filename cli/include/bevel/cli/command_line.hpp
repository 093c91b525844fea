// SPDX-License-Identifier: MIT
#pragma once
// Command lines for all programs, with CLI11 behind it: that header costs ten seconds a main, here it is compiled once.
// Exit status everywhere: 0 ok, 1 failed, 2 usage; of what reads recordings also 3, see exit_status.hpp. --help is
// alike everywhere: what the program does, usage, options, an example, exit statuses.
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bevel::cli {

class CommandLine {
 public:
  CommandLine(const std::string& program, const std::string& description);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  // The variable's value is the default, and --help shows it. `names` as "-c,--config".
  CommandLine& option(const std::string& names, std::string& value, const std::string& help, bool required = false);
  CommandLine& option(const std::string& names, double& value, const std::string& help, double lowest, double highest);
  CommandLine& option(const std::string& names, int& value, const std::string& help, int lowest, int highest);
  CommandLine& positive(const std::string& names, double& value, const std::string& help);
  CommandLine& non_negative(const std::string& names, double& value, const std::string& help);
  CommandLine& numbers(const std::string& names, std::vector<double>& value, const std::string& help, int count);
  CommandLine& choice(const std::string& names, std::string& value, const std::string& help,
                      const std::vector<std::string>& allowed);
  // Any number of files or folders after the option.
  CommandLine& paths(const std::string& names, std::vector<std::string>& values, const std::string& help);
  CommandLine& flag(const std::string& names, bool& value, const std::string& help);
  // Arguments without a name, at least one of them if required.
  CommandLine& arguments(const std::string& name, std::vector<std::string>& values, const std::string& help,
                         bool required = true);

  // Says in --help what status 3 means.
  CommandLine& reads_recordings();
  // A whole command, for --help.
  CommandLine& example(const std::string& command);
  // A further one for --help: "130 interrupted".
  CommandLine& exit_status(const std::string& status);

  // For what one option alone cannot say: `problem` is asked after parsing; text it returns is a usage error.
  CommandLine& check(std::function<std::string()> problem);

  // Parses, then runs `body`, whose exceptions become one message on stderr and status 1. Returns the exit status. An
  // unknown option is told of first, with the nearest known one: what it should have given is then missing as well.
  int run(int argc, char** argv, const std::function<int()>& body);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bevel::cli
