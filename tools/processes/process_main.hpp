#pragma once
// What the five processes' mains share: the options, LCM, the errors' exit status (0 ok, 1 failed, 2 usage).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <stdexcept>

#include "nodes/runtime.hpp"
#include "nodes/system_config.hpp"

namespace bevel::tools {

struct ProcessOptions {
  std::string config_path;
  std::string lcm_url;
};

inline void add_options(CLI::App& app, ProcessOptions& options) {
  app.set_version_flag("--version", BEVEL_VERSION);
  app.add_option("-c,--config", options.config_path, "system file (TOML); config/demo.toml is one")->required();
  app.add_option("--lcm-url", options.lcm_url, "LCM provider; default: system.lcm_url, then LCM_DEFAULT_URL");
}

// Parses, loads, and runs `body`; every error ends as one message on stderr.
template <class Body>
int process_main(int argc, char** argv, CLI::App& app, ProcessOptions& options, Body&& body) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    const nodes::SystemConfig config = nodes::load_system_config(options.config_path);
    lcm::LCM lcm(options.lcm_url.empty() ? config.lcm_url : options.lcm_url);
    if (!lcm.good()) throw std::runtime_error("LCM does not start; is multicast routed? (see docs/running.md)");
    nodes::catch_signals();
    return body(config, lcm);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), e.what());
    return 1;
  }
}

}  // namespace bevel::tools
