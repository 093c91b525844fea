// SPDX-License-Identifier: MIT
// Arbitrary text as each of the TOML files. It is rejected with a ConfigError that states the place, or it is a
// configuration: a model file then survives being written and read, to the last bit, and can be put to work.
#include <cmath>
#include <limits>

#include <bevel/error.hpp>
#include <bevel/io/csv_import.hpp>
#include <bevel/io/live_effects.hpp>
#include <bevel/io/model_file.hpp>
#include <bevel/nodes/system_config.hpp>
#include "tests/fuzz/fuzz_support.hpp"

namespace bevel::fuzz {
namespace {

void check(const io::ConfigError& error, const std::string& name) {
  BEVEL_MUST(!error.messages().empty());
  for (const std::string& message : error.messages())
    BEVEL_MUST_SAYING(message.starts_with(name + ":") && message.size() > name.size() + 2, message);
}

// Anything but a ConfigError leaves by the top, as a finding.
template <class Read>
void read_or_refuse(const std::string& name, Read&& read) {
  try {
    read();
  } catch (const io::ConfigError& error) {
    check(error, name);
  }
}

// Every way in which a section is read, on keys that the input may have.
void read_anything(std::string_view text) {
  io::ConfigFile file = io::ConfigFile::parse(text, "any");
  BEVEL_MUST(file.text() == text);
  const auto look = [](io::Section s, auto& self, int depth) -> void {
    double number = std::numeric_limits<double>::quiet_NaN();
    s.read("a", number, io::optional, io::in_range(-1, 1));
    BEVEL_MUST(std::isnan(number) || (number >= -1 && number <= 1));
    std::int64_t whole = 7;
    s.read("b", whole, io::optional, io::at_least(7));
    BEVEL_MUST(whole >= 7);
    int narrow = 0;
    s.read("b", narrow, io::optional);
    BEVEL_MUST(whole == 7 || narrow == whole || narrow == 0);
    std::array<double, 3> triple{1, 1, 1};
    s.read("c", triple, io::optional, io::above(0));
    for (const double value : triple) BEVEL_MUST(value > 0 && std::isfinite(value));
    std::vector<std::string> names;
    s.read("d", names, io::optional, io::in_range(1, 4));
    BEVEL_MUST(names.size() <= 4);
    std::string one;
    s.read("e", one, io::optional);
    bool truth = false;
    s.read("f", truth, io::optional);
    int chosen = 0;
    s.read("e", chosen, io::optional, io::Choices<int>{{"one", 1}, {"two", 2}});
    BEVEL_MUST(chosen == 0 || one == (chosen == 1 ? "one" : "two"));
    if (depth == 0) return;
    for (io::Section& inner : s.sections("g", io::optional)) self(inner, self, depth - 1);
    for (io::Section& inner : s.children()) self(inner, self, depth - 1);
    for (const auto& [key, value] : s.read_remaining_numbers()) BEVEL_MUST_SAYING(std::isfinite(value), key);
  };
  look(file.root(), look, 3);
  file.finish();
}

void read_model(std::string_view text) {
  const io::ModelFile model = io::parse_model_file(text, "model");
  BEVEL_MUST(!model::find_domain_violation(model.needle));
  const std::string written = io::to_toml(model);
  try {
    const io::ModelFile again = io::parse_model_file(written, "written");
    BEVEL_MUST_SAYING(again == model, written);
    BEVEL_MUST_SAYING(io::to_toml(again) == written, written);
  } catch (const io::ConfigError& error) {
    BEVEL_MUST_SAYING(false, error.what() + ("\n" + written));
  }
  for (const auto& one : io::active_effects(model, "rec.lcm"))
    for (const model::Dual& value : one.parameters) BEVEL_MUST(std::isfinite(value.value));
  (void)io::live_effects(model.effects, model.discrepancies);
}

}  // namespace
}  // namespace bevel::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bevel;
  static fuzz::MemoryFile file("fuzz_toml");
  const std::string_view text = fuzz::as_text(data, size);
  fuzz::read_or_refuse("any", [&] { fuzz::read_anything(text); });
  fuzz::read_or_refuse("model", [&] { fuzz::read_model(text); });
  const std::string& path = file.hold(text);
  fuzz::read_or_refuse(path, [&] {
    const nodes::SystemConfig config = nodes::load_system_config(path);
    BEVEL_MUST(config.text == text && stepper::problems_of(config.stepper).empty());
    BEVEL_MUST(!model::find_domain_violation(config.needle) && !model::find_domain_violation(config.rig.truth));
  });
  fuzz::read_or_refuse(path, [&] { (void)io::load_column_map(path); });
  return 0;
}
