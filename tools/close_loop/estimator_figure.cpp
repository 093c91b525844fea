#include "tools/close_loop/estimator_figure.hpp"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>

#include "tools/replay/batch.hpp"

namespace bevel::close_loop {
namespace {

constexpr double kAlong = 0.99;         // cosine
constexpr double kSignificance = 0.01;  // of one series, and of their number

}  // namespace

std::vector<replay::NoiseColour> noise_by_axis(const diagnosis::RecordedCase& recorded, const diagnosis::Noise& noise) {
  std::vector<replay::NoiseColour> colours(3);
  for (std::size_t c = 0; c < recorded.channels.size(); ++c)
    for (int i = 0; i < 3; ++i)
      if (std::abs(recorded.channels[c].axis[i]) > kAlong)
        colours[static_cast<std::size_t>(i)] = {noise.sigma_mm[c], noise.ar1};
  return colours;
}

estimator::EstimatorConfig with_needle_known(estimator::EstimatorConfig config,
                                             const diagnosis::NeedleEstimate& known) {
  config.prior.curvature_sd_per_mm = std::min(config.prior.curvature_sd_per_mm, known.curvature_sd_per_mm);
  config.prior.lambda1_sd_per_rad = std::min(config.prior.lambda1_sd_per_rad, known.lambda1_sd_per_rad);
  config.prior.lambda2_sd = std::min(config.prior.lambda2_sd, known.lambda2_sd);
  return config;
}

EstimatorFigure replay_case(const std::vector<std::string>& logs, const io::ModelFile& model,
                            const std::vector<replay::NoiseColour>& noise, estimator::EstimatorConfig config) {
  config.prior.needle = model.needle;
  replay::ReplayOptions options;
  options.noise_by_axis = noise;
  options.effects = model.effects;
  EstimatorFigure figure;
  for (const replay::Replay& one : replay::replay_logs(logs, config, options)) {
    const replay::InnovationFigures innovations = replay::innovation_figures(one);
    figure.measurements += innovations.measurements;
    figure.rejected += innovations.rejected;
    figure.resets += innovations.resets;
    replay::ChiSquareMean own;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      if (!(noise[i].sd_mm > 0)) continue;
      const auto white = replay::whiten(replay::axis_innovations(one, axis), noise[i]);
      for (const double u : white) {
        figure.nis.add(u * u, 1);
        figure.axis[i].add(u * u, 1);
        own.add(u * u, 1);
      }
      ++figure.series;
      if (replay::ljung_box(white).p_value < kSignificance) ++figure.coloured;
    }
    figure.nis_by_recording.push_back(own.mean());
  }
  const boost::math::binomial by_chance(std::max(1, figure.series), kSignificance);
  figure.coloured_by_chance =
      static_cast<int>(boost::math::quantile(boost::math::complement(by_chance, kSignificance)));
  return figure;
}

}  // namespace bevel::close_loop
