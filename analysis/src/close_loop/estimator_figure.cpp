// SPDX-License-Identifier: MIT
#include <bevel/analysis/close_loop/estimator_figure.hpp>

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>

#include <bevel/analysis/replay/batch.hpp>

namespace bevel::analysis {
namespace {

constexpr double kSignificance = 0.01;  // of one series, and of their number

}  // namespace

std::vector<NoiseColour> measure_noise(const std::vector<std::string>& logs, const io::ModelFile& model,
                                       estimator::EstimatorConfig config) {
  config.prior.needle = model.needle;  // which plays no part: the readings are looked at alone
  const auto replays = replay_logs(logs, config);
  std::vector<NoiseColour> noise;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<std::vector<AxisSample>> readings;
    readings.reserve(replays.size());
    for (const auto& one : replays) readings.push_back(axis_samples(one, axis));
    noise.push_back(measure_noise(readings));
  }
  return noise;
}

estimator::EstimatorConfig with_needle_known(estimator::EstimatorConfig config,
                                             const diagnosis::NeedleEstimate& known) {
  config.prior.curvature_sd_per_mm = std::min(config.prior.curvature_sd_per_mm, known.curvature_sd_per_mm);
  config.prior.lambda1_sd_per_rad = std::min(config.prior.lambda1_sd_per_rad, known.lambda1_sd_per_rad);
  config.prior.lambda2_sd = std::min(config.prior.lambda2_sd, known.lambda2_sd);
  return config;
}

EstimatorFigure replay_case(const std::vector<std::string>& logs, const io::ModelFile& model,
                            const std::vector<NoiseColour>& noise, estimator::EstimatorConfig config) {
  config.prior.needle = model.needle;
  config.prior.variation = model.variation.value_or(model::Variation{});
  ReplayOptions options;
  options.noise_by_axis = noise;
  options.effects = model.effects;
  options.discrepancies = model.discrepancies;
  EstimatorFigure figure;
  for (const Replay& one : replay_logs(logs, config, options)) {
    const InnovationFigures innovations = innovation_figures(one);
    figure.measurements += innovations.measurements;
    figure.rejected += innovations.rejected;
    figure.resets += innovations.resets;
    ChiSquareMean own;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      if (!(noise[i].sd_mm > 0)) continue;
      const auto white = whiten(axis_innovations(one, axis), noise[i]);
      for (const double u : white) {
        figure.nis.add(u * u, 1);
        figure.axis[i].add(u * u, 1);
        own.add(u * u, 1);
      }
      ++figure.series;
      if (ljung_box(white).p_value < kSignificance) ++figure.coloured;
    }
    figure.nis_by_recording.push_back(own.mean());
  }
  const boost::math::binomial by_chance(std::max(1, figure.series), kSignificance);
  figure.coloured_by_chance =
      static_cast<int>(boost::math::quantile(boost::math::complement(by_chance, kSignificance)));
  return figure;
}

}  // namespace bevel::analysis
