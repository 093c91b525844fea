// SPDX-License-Identifier: MIT
// The page and the files from findings of each verdict. That the page looks right is for eyes; here: complete,
// self-contained, no figure that is none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/report.hpp>
#include "tests/diagnosis/made_up_findings.hpp"

namespace bevel::analysis {
namespace {

using diagnosis::Verdict;
using diagnosis::testing::made_up;
using ::testing::HasSubstr;
using ::testing::Not;

std::string page_of(Verdict verdict, const std::string& name) {
  std::string html = report_html(made_up(verdict), {"0.1.0", {"model.toml", "ab12"}, {{"rec01.lcm", "cd34"}}});
  std::ofstream(std::filesystem::path(BEVEL_BINARY_DIR) / name) << html;
  return html;
}

void expect_sound(const std::string& html) {
  EXPECT_FALSE(std::regex_search(html, std::regex("(src|href)=[\"'](https?:)?//|url\\(http|@import|<script src")));
  EXPECT_FALSE(std::regex_search(html, std::regex("[\" >M]-?(nan|inf)[\" <,]")));
  EXPECT_LT(html.size(), 1'500'000U);
  // One box that says it all: the model as it stands, refitted, what noise alone would leave, and what is at the
  // target.
  const std::string box =
      html.substr(html.find("<section class=\"verdict"), html.find("</section>") - html.find("<section"));
  for (const char* figure : {"<span>error as it stands</span><b>", "<span>its needle refitted</span><b>",
                             "<span>noise alone</span><b>", "<span>tip at the target&#39;s depth moved by</span><b>"})
    EXPECT_THAT(box, HasSubstr(figure));
  for (const char* heading :
       {"What to do", "Parameters", "What is left over", "Recording by recording", "Paths", "Every effect", "predicted",
        "could have shown", "next experiment", "Noise and checks", "How this was made"})
    EXPECT_THAT(html, HasSubstr(heading));
}

TEST(Page, effects_found_names_them_with_sizes_and_rivals) {
  const std::string html = page_of(Verdict::effects_found, "page-effects-found.html");
  expect_sound(html);
  EXPECT_THAT(html, HasSubstr("torsional_windup: lag at 100mm 0.823 ± 0.031 rad"));
  EXPECT_THAT(html, HasSubstr("or rotation_backlash"));
  EXPECT_THAT(html, HasSubstr("<span>its needle refitted</span><b>1.21 mm</b>"));
  EXPECT_THAT(html, HasSubstr("<span>with what was found</span><b>0.264 mm</b>"));
  EXPECT_THAT(html, HasSubstr("at (s), rec03.lcm"));
  // In millimetres at the target: by each part, and by closed loop.
  EXPECT_THAT(html, HasSubstr("<span>steered to a target, off by</span><b>1.9 → 0.052 mm</b>"));
  EXPECT_THAT(html, HasSubstr("median of 8, of which 7 and 8 arrived"));
  EXPECT_THAT(html, HasSubstr("no rival; by how far it moves the tip is not known"));
  EXPECT_THAT(html, HasSubstr("or rotation_backlash; moves the tip by 1.8 mm"));
  EXPECT_THAT(html, HasSubstr("7 of 8"));
  EXPECT_THAT(html, HasSubstr("differs from one to the next: lost_steps."));
  EXPECT_THAT(html, Not(HasSubstr("The unknown part")));
  // What each insertion has of its own, and both ways of predicting one.
  EXPECT_THAT(html, HasSubstr("one standard deviation between insertions"));
  EXPECT_THAT(html, HasSubstr("tilt x (rad)"));
  EXPECT_THAT(
      html,
      HasSubstr("continued, beyond the first third</td><td class=\"number\">0.106</td><td class=\"number\">95 %"));
  EXPECT_THAT(html, HasSubstr("<td>0.0950 mm (95 %)</td>"));
}

TEST(Page, nothing_missing_points_to_what_would_have_been_seen) {
  const std::string html = page_of(Verdict::nothing_missing, "page-nothing-missing.html");
  expect_sound(html);
  EXPECT_THAT(html, HasSubstr("no size in reach"));
  EXPECT_THAT(html, HasSubstr("Nothing above the sizes listed"));
  EXPECT_THAT(html, Not(HasSubstr("Onset of the missing physics</h2>")));
}

TEST(Page, unknown_effect_shows_curves_and_no_name) {
  const std::string html = page_of(Verdict::unknown_effect, "page-unknown-effect.html");
  expect_sound(html);
  EXPECT_THAT(html, HasSubstr("curvature toward the bevel"));
  EXPECT_THAT(html, HasSubstr("The unknown part, described"));
  EXPECT_THAT(html, HasSubstr("a (1 - exp(-(x - 0) / s))"));
}

TEST(Page, says_by_how_much_the_tip_is_moved_at_depth) {
  diagnosis::Findings f;
  EXPECT_FALSE(moved_at_depth(f));
  // Two recordings, moved by 5 and by 1 mm where each is deepest, and by more where it is not.
  const auto trace = [&](double deepest_mm, const Eigen::Vector3d& by_mm) {
    diagnosis::Trace t;
    for (const double depth_mm : {0.4 * deepest_mm, deepest_mm, 0.7 * deepest_mm}) {
      t.covariates.emplace_back()[model::Covariate::depth_mm] = depth_mm;
      const bool at_end = depth_mm == deepest_mm;
      t.before_mm.push_back(Eigen::Vector3d::Constant(7));
      t.after_mm.push_back(t.before_mm.back() + (at_end ? by_mm : Eigen::Vector3d(90, 0, 0)));
      t.model_file_mm.push_back(t.after_mm.back() + Eigen::Vector3d(0, 0, at_end ? 2 : 80));
    }
    return t;
  };
  f.traces = {trace(60, {3, 4, 0}), trace(90, {0, 0, 1})};
  const auto moved = moved_at_depth(f);
  ASSERT_TRUE(moved);
  EXPECT_NEAR(moved->from_refitted_mm, std::sqrt((25 + 1) / 2.0), 1e-12);
  EXPECT_NEAR(moved->from_file_mm, 2, 1e-12);
  EXPECT_EQ(moved->depth_mm[0], 60);
  EXPECT_EQ(moved->depth_mm[1], 90);
  EXPECT_THAT(page_of(Verdict::effects_found, "page-effects-found.html"),
              HasSubstr("tip at the target&#39;s depth moved by"));
}

TEST(Page, says_what_a_target_is_missed_by) {
  diagnosis::Findings f;
  f.sentence = "A play.";
  f.effects.emplace_back();
  f.effects.back().name = "rotation_backlash";
  f.effects.back().probability = 0.98;
  f.effects.back().moved_at_depth_mm = 1.7;
  EXPECT_THAT(report_html(f, {}), Not(HasSubstr("estimator and controller believe")));
  f.steered = diagnosis::SteeredToTargets{
      .targets = 8,
      .seed = 5,
      .depth_mm = {81, 90},
      .as_it_stands =
          {.arrived = 7,
           .median_mm = 1.86,
           .worst_mm = 4.4,
           .stopped = {{"needle state unhealthy, measurements rejected in a row", 1, {6, 6}, 5, "", {31, 31}}}},
      .found = {.arrived = 8, .median_mm = 0.06, .worst_mm = 0.11}};
  const std::string html = report_html(f, {});
  EXPECT_THAT(html, HasSubstr("moves the tip by 1.7 mm"));
  EXPECT_THAT(html, HasSubstr("1.9 → 0.060 mm"));
  EXPECT_THAT(html, HasSubstr("7 of 8"));
  EXPECT_THAT(html,
              HasSubstr("1: needle state unhealthy, measurements rejected in a row: 6, limit 5, at a depth of 31 mm"));
  EXPECT_THAT(html, HasSubstr("81 to 90 mm deep"));
  f.steered.reset();
  f.not_steered = "the recordings have no clock";
  EXPECT_THAT(report_html(f, {}), HasSubstr("the recordings have no clock"));
}

// Figures that the diagnosis may leave empty.
TEST(Page, advice_for_steering_follows_from_the_paired_misses) {
  auto findings = made_up(Verdict::effects_found);
  const auto page = [&] { return report_html(findings, {}); };
  auto& steered = *findings.steered;
  steered.as_it_stands = {.arrived = 8, .median_mm = 0.19, .worst_mm = 0.40};
  steered.found = {.arrived = 8, .median_mm = 0.33, .worst_mm = 0.79};
  steered.paired = {.targets = 8, .farther_mm = 0.14, .std_error_mm = 0.08};  // as chance may bring
  EXPECT_THAT(page(), HasSubstr("adopt this model for steering or keep the model as it stands"));
  steered.paired.std_error_mm = 0.05;
  EXPECT_THAT(
      page(),
      HasSubstr("missed by 0.14 +- 0.050 mm more with the model that was found (mean of 8): do not adopt this model"));
  steered.paired.farther_mm = -0.14;
  EXPECT_THAT(page(), HasSubstr("mm less with the model that was found (mean of 8): adopt this model for steering."));
  EXPECT_THAT(page(), HasSubstr("simulator, estimator and bevel-predict read it"));
  steered.found.arrived = 7;
  EXPECT_THAT(page(), HasSubstr("do not adopt this model"));
  EXPECT_THAT(page(), HasSubstr("in place of the model in use for simulation and prediction, not for steering"));
  steered.as_it_stands.arrived = steered.found.arrived = 0;
  steered.paired.targets = 0;
  EXPECT_THAT(page(), HasSubstr("Do not adopt this model for steering: no target was reached with it"));
}

TEST(Page, what_is_left_may_be_less_than_the_noise_or_only_correlated) {
  auto findings = made_up(Verdict::effects_found);
  const auto left = [&](double chi2, double p) {
    findings.checks = {.chi2_per_dof = chi2, .band = {0.92, 1.08}, .ljung_box_p = p, .clean = false};
    return report_html(findings, {});
  };
  EXPECT_THAT(left(1.2, 0.5), HasSubstr("What is left is more than the fitted noise; the verdict"));
  EXPECT_THAT(left(0.83, 0.5), HasSubstr("What is left is less than the fitted noise; the verdict"));
  EXPECT_THAT(left(1.2, 0.001), HasSubstr("What is left is more than the fitted noise, and correlated; the verdict"));
  EXPECT_THAT(left(1, 0.001), HasSubstr("What is left is correlated from reading to reading; the verdict"));
}

// No picture of a log without a clock is against time, or against what would need one.
TEST(Page, draws_stops_where_there_is_no_clock) {
  auto findings = made_up(Verdict::effects_found);
  const char* by_time[] = {"time (s)", "time in the recording", "speed of insertion", "time since stop",
                           ", over time."};
  const std::string with_clock = report_html(findings, {});
  findings.stop_s = 0.1;
  const std::string without = report_html(findings, {});
  for (const char* text : by_time) {
    EXPECT_THAT(with_clock, HasSubstr(text));
    EXPECT_THAT(without, Not(HasSubstr(text)));
  }
  EXPECT_THAT(without, HasSubstr("rec03.lcm, tip.y: stops 31 to 50"));
  EXPECT_THAT(without, HasSubstr("rec03.lcm, stop by stop."));
  EXPECT_THAT(without, HasSubstr("inserted length"));
}

TEST(Page, next_experiment_says_how_many_recordings_it_takes) {
  auto findings = made_up(Verdict::effects_found);
  ASSERT_TRUE(findings.next_experiment);
  const auto page = [&](double gain) {
    findings.next_experiment->expected_gain = gain;
    return report_html(findings, {});
  };
  EXPECT_THAT(page(12), HasSubstr("25 settles it).<"));
  EXPECT_THAT(page(3), HasSubstr("25 settles it), so it takes 4 of them."));
  EXPECT_THAT(page(0.36), HasSubstr("so none of these motions tells them apart in earnest."));
  EXPECT_THAT(page(0), HasSubstr("so none of these motions tells them apart in earnest."));
}

TEST(Page, next_experiment_is_none_needed_where_there_is_no_doubt) {
  auto findings = made_up(Verdict::effects_found);
  findings.probability = 0.995;
  EXPECT_THAT(report_html(findings, {}), HasSubstr("None needed: the verdict has a probability of"));
  findings.verdict = Verdict::inconclusive;
  findings.next_experiment.reset();
  EXPECT_THAT(report_html(findings, {}), HasSubstr("No motion that was simulated separates"));
}

TEST(Page, an_inconclusive_verdict_says_why_and_adopts_nothing) {
  const std::string html = report_html(made_up(Verdict::inconclusive), {});
  EXPECT_THAT(html, HasSubstr("Inconclusive. The recordings do not decide"));
  EXPECT_THAT(html, HasSubstr("Do not change the model yet"));
}

TEST(Page, holds_when_findings_are_bare) {
  diagnosis::Findings bare;
  bare.sentence = "Nothing <b>at all</b>.";
  bare.held_out.before.rmse_mm = std::nan("");
  const std::string html = report_html(bare, {});
  EXPECT_THAT(html, HasSubstr("Nothing &lt;b&gt;at all"));
  EXPECT_FALSE(std::regex_search(html, std::regex("[\" >M]-?(nan|inf)[\" <,]")));
}

}  // namespace
}  // namespace bevel::analysis
