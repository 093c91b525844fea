#pragma once
// Maximum likelihood of a hypothesis on all recordings at once, with the noise held fixed.
//
// Problem   minimise chi2 = sum of squared whitened residuals + ((q - belief)/width)^2 over the needle's three, within
//           bounds; the width of the belief in the model file is so large that it decides only what nothing else does.
// Solution  Levenberg-Marquardt with the sensitivities of one pass (model/effects), bounds by an active set.
#include "diagnosis/mismatch/hypothesis.hpp"
#include "diagnosis/mismatch/noise.hpp"

namespace bevel::diagnosis {

// What the likelihood is of: a case, its noise, and the model file's belief about the needle.
struct Evidence {
  const RecordedCase* recorded = nullptr;
  Noise noise;
  model::NeedleParameters belief;
  // Widths of that belief: half of k, and all of Table I and beyond for lambda.
  double curvature_width_share = 0.5;
  double lambda1_width_per_rad = 0.5;
  double lambda2_width = 0.3;
  std::vector<bool> used;  // per recording; empty: all
  bool uses(std::size_t recording) const { return used.empty() || used[recording]; }
};

// Whitened residuals (measured - model) of one recording, all channels one after the other, and d(residual)/d(column).
struct Residuals {
  Eigen::VectorXd white;
  Eigen::MatrixXd jacobian;  // rows as white, columns as Hypothesis::columns
};

struct Workspace {
  model::OpenLoop open_loop;
  Residuals residuals;
};

// False where the tip leaves the domain of the slip law.
bool evaluate(const Evidence& evidence, const Hypothesis& hypothesis, std::size_t recording,
              const Eigen::VectorXd& values, bool with_jacobian, Workspace& workspace);

struct Fit {
  explicit Fit(const Hypothesis& h) : hypothesis(h) {}
  Hypothesis hypothesis;
  Eigen::VectorXd values;
  double chi2 = 0;       // without the belief's part
  double penalised = 0;  // with it
  std::vector<double> chi2_by_recording;
  std::vector<std::size_t> count_by_recording;
  Eigen::MatrixXd information;  // J^T J + belief, of all unknowns
  bool valid = false;
  int iterations = 0;

  std::size_t count() const;
  // Inverse of the information over the unknowns that the data move; zero rows for the rest.
  Eigen::MatrixXd covariance() const;
};

struct FitRules {
  int max_iterations = 30;
  double tolerance = 2e-3;      // of chi2: what changes it by less is done
  std::vector<int> held{};      // unknowns that stay where they start
  Eigen::MatrixXd precision{};  // of an expectation of the unknowns about zero; empty: none
};

Fit fit(const Evidence& evidence, const Hypothesis& hypothesis, const Eigen::VectorXd& start,
        const FitRules& rules = {});

// Measured - model in mm, of one channel of one recording.
Eigen::VectorXd errors_of(const Series& series, const Channel& channel, const model::OpenLoop& path);
// Errors in mm, per recording and channel (measured - model), for noise calibration and pictures.
Errors errors_of(const Evidence& evidence, const Fit& fit);

}  // namespace bevel::diagnosis
