// SPDX-License-Identifier: MIT
// Tables of what was compared.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tests/ceiling/ceiling.hpp"

namespace bevel::ceiling {

using nlohmann::json;

namespace {

std::string fixed(const char* format, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string joined(const json& names) {
  std::string out;
  for (const auto& name : names) out += (out.empty() ? "" : " + ") + name.get<std::string>();
  return out.empty() ? "nothing" : out;
}

double number(const json& one, const char* key) { return one.at(key).get<double>(); }

// By how much the truth is likelier than the likeliest explanation that is another answer, by whosever forms.
double margin(const json& one) {
  return number(one, "truth") - std::max(number(one, "rival_log"), number(one, "rival_by_generator"));
}

// So near that forms, integrators and fits may have it either way: the two bases differ by as much where nothing is
// concealed.
constexpr double kTie = 0.5;

struct Row {
  int trials = 0, right = 0, won = 0, right_of_won = 0, tied = 0, right_of_tied = 0, lost = 0, right_of_lost = 0;
};

std::string row_of(const char* trial_class, const std::vector<json>& compared) {
  Row row;
  for (const json& one : compared) {
    if (one.at("class") != trial_class || one.at("visibility") != "visible") continue;
    const bool right = one.at("right"), tied = std::abs(margin(one)) <= kTie;
    const bool won = !tied && margin(one) > 0;
    ++row.trials;
    row.right += right;
    ++(tied ? row.tied : won ? row.won : row.lost);
    (tied ? row.right_of_tied : won ? row.right_of_won : row.right_of_lost) += right;
  }
  const auto of = [](int right, int all) { return std::to_string(all) + " (" + std::to_string(right) + ")"; };
  return "| " + std::string(trial_class) + " | " + of(row.right, row.trials) + " | " + of(row.right_of_won, row.won) +
         " | " + of(row.right_of_tied, row.tied) + " | " + of(row.right_of_lost, row.lost) + " |\n";
}

}  // namespace

std::string report(const std::vector<json>& compared) {
  std::string out =
      "| class | trials (right) | the truth wins (right) | as likely (right) | loses (right) |\n"
      "| --- | --- | --- | --- | --- |\n";
  for (const char* trial_class : {"one", "two", "unlisted", "beam"}) out += row_of(trial_class, compared);
  out +=
      "\n| trial | concealed | shows | said | truth less the likeliest other answer | which | by the library |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n";
  for (const json& one : compared) {
    if (one.at("visibility") != "visible") continue;
    const bool by_generator = number(one, "rival_by_generator") > number(one, "rival_log");
    const double ours = number(one, "same_answer_by_library") - number(one, "rival_log");
    out += "| " + std::to_string(one.at("trial").get<int>()) + " | " + joined(one.at("concealed")) + " | " +
           fixed("%.1f", number(one, "visible_sigmas")) + " | " +
           (one.at("right").get<bool>() ? "right" : joined(one.at("said"))) + " | " + fixed("%+.1f", margin(one)) +
           " | " + one.at("rival").get<std::string>() + (by_generator ? " (generator's form)" : "") + " | " +
           (ours > -1e5 ? fixed("%+.1f", ours) : "not visited") + " |\n";
  }
  int unlisted = 0, called = 0, to_be_called = 0;
  for (const json& one : compared) {
    if (one.at("class") != "unlisted" || one.at("visibility") != "visible") continue;
    ++unlisted;
    called += std::ranges::find(one.at("said"), "unknown") != one.at("said").end();
    to_be_called +=
        number(one, "truth") > std::max(number(one, "without_unknown_log"), number(one, "rival_by_generator")) + kTie;
  }
  out += "\nOn no list: " + std::to_string(unlisted) + " visible; likelier than nothing and than every set of names " +
         std::to_string(to_be_called) + ", called unknown " + std::to_string(called) + ".\n";
  double sum = 0, squares = 0, largest = 0;
  int nulls = 0;
  for (const json& one : compared) {
    if (one.at("visibility") != "null") continue;
    const double difference = number(one, "truth_without_curve") - number(one, "nothing_by_library_without_curve");
    ++nulls;
    sum += difference;
    squares += difference * difference;
    largest = std::max(largest, std::abs(difference));
  }
  if (nulls > 0)
    out += "\nNulls: " + std::to_string(nulls) + "; generator's log evidence less the library's: mean " +
           fixed("%+.3f", sum / nulls) + ", root mean square " + fixed("%.3f", std::sqrt(squares / nulls)) +
           ", largest " + fixed("%.3f", largest) + ".\n";
  return out;
}

}  // namespace bevel::ceiling
