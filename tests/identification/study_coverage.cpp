// SPDX-License-Identifier: MIT
// 200 simulated data sets: how often do the 95 % intervals contain the truth? Prints counts with Wilson's band and
// writes a page with pictures: study_coverage [PAGE.html] [SETS].
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include <bevel/report/page.hpp>
#include "tests/identification/coverage_study.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  using namespace bevel::diagnosis;
  constexpr std::uint64_t kSeed = 20150928;
  const int sets = argc > 2 ? std::atoi(argv[2]) : 200;
  bool good = true;
  report::Page page("Coverage of the 95 % intervals");
  std::printf("seed %llu, %d data sets of 6 trials, 195 measurements each, 0.2 mm\n",
              static_cast<unsigned long long>(kSeed), sets);
  struct Case {
    const char* name;
    double lambda1, lambda2, outliers;
    Loss loss;
  };
  for (const Case& c : {Case{"agar, square loss", 0.49, 0.22, 0, Loss::square},
                        Case{"agar, Huber's loss, 2 % outliers", 0.49, 0.22, 0.02, Loss::huber},
                        Case{"plastisol, Huber's loss", 0.144, 0.032, 0, Loss::huber}}) {
    model::NeedleParameters truth;
    truth.lambda1_per_rad = c.lambda1;
    truth.lambda2 = c.lambda2;
    SimulatedInsertion plan;
    plan.outlier_share = c.outliers;
    FitOptions options;
    options.start = truth;
    options.start.curvature_per_mm = 0.0042;
    options.loss = c.loss;
    page.heading(c.name);
    for (const auto& p : coverage_study(truth, sets, kSeed, plan, 6, options)) {
      const proof::Interval band = proof::wilson95(p.inside);
      const double share = p.inside.value();
      const bool inside = share >= 0.93 && share <= 0.97;
      std::printf("%-34s %-18s %3d of %d = %.1f %%  (Wilson 95 %%: %.1f to %.1f) %s\n", c.name,
                  kParameterNames[p.parameter], p.inside.hits, p.inside.of, 100 * share, 100 * band.low,
                  100 * band.high, inside ? "" : "outside 93-97 %");
      good = good && band.low <= 0.95 && 0.95 <= band.high;
      std::vector<double> z = p.z, expected, order;
      std::sort(z.begin(), z.end());
      // Ordered errors against the standard normal's quantiles (Hastings' approximation is enough for a picture).
      for (std::size_t i = 0; i < z.size(); ++i) {
        const double u = (static_cast<double>(i) + 0.5) / static_cast<double>(z.size());
        const double t = std::sqrt(-2 * std::log(std::min(u, 1 - u)));
        const double q = t - (2.30753 + 0.27061 * t) / (1 + 0.99229 * t + 0.04481 * t * t);
        expected.push_back(u < 0.5 ? -q : q);
      }
      report::Figure figure;
      figure.x_label = "quantile of the standard normal";
      figure.y_label = "(estimate - truth) / standard error";
      figure.points("data sets", expected, z).line("as it should be", {-3, 3}, {-3, 3});
      figure.references = {{report::Reference::Axis::horizontal, 1.96, "95 %"},
                           {report::Reference::Axis::horizontal, -1.96, ""}};
      char caption[160];
      std::snprintf(caption, sizeof caption,
                    "%s: %d of %d intervals contain the truth (Wilson 95 %%: %.1f to %.1f %%).",
                    kParameterNames[p.parameter], p.inside.hits, p.inside.of, 100 * band.low, 100 * band.high);
      page.figure(figure, caption);
    }
  }
  if (argc > 1) page.save(argv[1]);
  return good ? 0 : 1;
}
