// SPDX-License-Identifier: MIT
#include <bevel/analysis/replay/report.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <bevel/estimator/health.hpp>
#include <bevel/io/result_file.hpp>
#include <bevel/report/page.hpp>

namespace bevel::analysis {
namespace {

constexpr const char* kAxisName[] = {"x", "y", "z"};

template <class... Values>
std::string text_of(const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string with_band(const ChiSquareMean& mean) {
  return text_of("%.3f  95 %% band [%.3f, %.3f]  %s", mean.mean(), mean.lowest(), mean.highest(),
                 mean.in_band() ? "in" : "OUT");
}

double sd(const estimator::FilterState& state, Eigen::Index i) { return std::sqrt(state.covariance(i, i)); }

// Standard deviation of the tip along the axes of {A}.
Eigen::Vector3d position_sd_mm(const estimator::FilterState& state) {
  const Eigen::Matrix3d& R = state.pose.R;
  return (R * state.covariance.topLeftCorner<3, 3>() * R.transpose()).diagonal().cwiseSqrt();
}

class CsvFile {
 public:
  CsvFile(std::string path, const char* header) : path_(std::move(path)), text_(std::string(header) + "\n") {}
  template <class... Values>
  void row(const char* format, Values... values) {
    const auto size = static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...));
    const std::size_t from = text_.size();
    text_.resize(from + size + 1);  // snprintf() ends with a zero
    std::snprintf(text_.data() + from, size + 1, format, values...);
    text_.pop_back();
  }
  void close() const { io::write_result_file(path_, text_); }

 private:
  std::string path_, text_;
};

void write_csv(const Replay& replay, const std::string& stem) {
  CsvFile states(stem + ".states.csv",
                 "utime,insertion_mm,rotation_rad,x_mm,y_mm,z_mm,qw,qx,qy,qz,curvature_per_mm,lambda1_per_rad,lambda2,"
                 "x_sd_mm,y_sd_mm,z_sd_mm,tilt_x_sd_rad,tilt_y_sd_rad,roll_sd_rad,curvature_sd_per_mm,"
                 "lambda1_sd_per_rad,lambda2_sd,test_ratio,health,resets,wheelbase_mm,wheelbase_sd_mm");
  for (const StateRow& row : replay.states) {
    const estimator::FilterState s = row.state.unpacked();
    const Eigen::Quaterniond q(s.pose.R);
    const Eigen::Vector3d spread = position_sd_mm(s);
    states.row("%lld,%.6f,%.6f,%.6f,%.6f,%.6f,%.9f,%.9f,%.9f,%.9f,%.9g,%.9g,%.9g,", static_cast<long long>(row.utime),
               row.insertion_mm, row.rotation_rad, s.pose.p_mm.x(), s.pose.p_mm.y(), s.pose.p_mm.z(), q.w(), q.x(),
               q.y(), q.z(), s.curvature_per_mm, s.lambda1_per_rad, s.lambda2);
    states.row("%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%d,%d,%.6g,%.6g\n", spread.x(), spread.y(),
               spread.z(), sd(s, 3), sd(s, 4), sd(s, 5), sd(s, 6), sd(s, 7), sd(s, 8), row.test_ratio, row.health,
               s.reset_count, s.wheelbase_mm, s.bending_mm > 0 ? 0 : std::sqrt(s.tenth_variance));
  }
  states.close();
  CsvFile innovations(stem + ".innovations.csv",
                      "utime,seq,camera,accepted,rank,mahalanobis2,x_mm,y_mm,z_mm,innovation_x_mm,innovation_y_mm,"
                      "innovation_z_mm,state_variance_x_mm2,state_variance_y_mm2,state_variance_z_mm2");
  for (const InnovationRow& row : replay.innovations)
    innovations.row(
        "%lld,%lld,%d,%d,%d,%.6g,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6g,%.6g,%.6g\n", static_cast<long long>(row.utime),
        static_cast<long long>(row.seq), row.camera, static_cast<int>(row.accepted), row.rank, row.mahalanobis2,
        row.position_mm.x(), row.position_mm.y(), row.position_mm.z(), row.innovation_mm.x(), row.innovation_mm.y(),
        row.innovation_mm.z(), row.state_variance_mm2.x(), row.state_variance_mm2.y(), row.state_variance_mm2.z());
  innovations.close();
  if (replay.headings.empty()) return;
  CsvFile headings(stem + ".headings.csv",
                   "utime,seq,camera,accepted,rank,mahalanobis2,innovation_a_rad,innovation_b_rad");
  for (const HeadingRow& row : replay.headings)
    headings.row("%lld,%lld,%d,%d,%d,%.6g,%.6f,%.6f\n", static_cast<long long>(row.utime),
                 static_cast<long long>(row.seq), row.camera, static_cast<int>(row.accepted), row.rank,
                 row.mahalanobis2, row.innovation_rad[0], row.innovation_rad[1]);
  headings.close();
}

double seconds(const Replay& replay, std::int64_t utime) {
  return static_cast<double>(utime - replay.states.front().utime) * 1e-6;
}

// A state over time with its 2-sigma band.
template <class Value, class Spread>
report::Figure band_figure(const Replay& replay, const std::string& label, Value value, Spread spread) {
  std::vector<double> t_s, y, low, high;
  for (const StateRow& row : replay.states) {
    const estimator::FilterState state = row.state.unpacked();
    t_s.push_back(seconds(replay, row.utime));
    y.push_back(value(state));
    low.push_back(y.back() - 2 * spread(state));
    high.push_back(y.back() + 2 * spread(state));
  }
  report::Figure figure;
  figure.y_label = label;
  figure.height_px = 150;
  figure.link = "time";
  figure.band("2 sigma", t_s, low, high, report::Colour::blue).line("estimate", t_s, y, report::Colour::blue);
  return figure;
}

// Of each camera by itself: cameras take turns in the log.
void add_measured(report::Figure& figure, const Replay& replay, Eigen::Index axis) {
  std::map<int, std::pair<std::vector<double>, std::vector<double>>> by_camera;
  for (const InnovationRow& row : replay.innovations) {
    if (!row.sees[static_cast<std::size_t>(axis)]) continue;
    auto& [t_s, position_mm] = by_camera[row.camera];
    t_s.push_back(seconds(replay, row.utime));
    position_mm.push_back(row.position_mm[axis]);
  }
  auto colour = static_cast<int>(report::Colour::orange);
  for (auto& [camera, of_camera] : by_camera)
    figure.points("camera " + std::to_string(camera), std::move(of_camera.first), std::move(of_camera.second),
                  static_cast<report::Colour>(colour++ % report::kColours));
}

report::Space path_in_space(const Replay& replay) {
  report::SpacePath path{.label = "estimate", .points_mm = {}};
  for (const StateRow& row : replay.states) {
    const Eigen::Vector3d p_mm = row.state.unpacked().pose.p_mm;
    path.points_mm.push_back({p_mm.x(), p_mm.y(), p_mm.z()});
    path.key.push_back(seconds(replay, row.utime));
  }
  return {.paths = {std::move(path)}, .link = "time"};
}

void add_state_figures(report::Page& page, const Replay& replay) {
  page.space(path_in_space(replay), "The estimated tip in {A}.");
  std::vector<report::Figure> position;
  for (const Eigen::Index i : {0, 1, 2}) {
    position.push_back(band_figure(
        replay, std::string(kAxisName[i]) + " (mm)", [i](const estimator::FilterState& s) { return s.pose.p_mm[i]; },
        [i](const estimator::FilterState& s) { return position_sd_mm(s)[i]; }));
    add_measured(position.back(), replay, i);
  }
  position.back().x_label = "time (s)";
  page.figures(position, 1, "The tip: its estimate, and what the cameras measured.");
  std::vector<report::Figure> needle{
      band_figure(
          replay, "k (1/mm)", [](const estimator::FilterState& s) { return s.curvature_per_mm; },
          [](const estimator::FilterState& s) { return sd(s, 6); }),
      band_figure(
          replay, "lambda1 (1/rad)", [](const estimator::FilterState& s) { return s.lambda1_per_rad; },
          [](const estimator::FilterState& s) { return sd(s, 7); }),
      band_figure(
          replay, "lambda2", [](const estimator::FilterState& s) { return s.lambda2; },
          [](const estimator::FilterState& s) { return sd(s, 8); })};
  needle.back().x_label = "time (s)";
  page.figures(needle, 1,
               "Curvature and slip. A band as wide as the prior's says that the path so far does not show it.");
  std::vector<double> t_s, roll_sd_rad;
  for (const StateRow& row : replay.states) {
    t_s.push_back(seconds(replay, row.utime));
    roll_sd_rad.push_back(sd(row.state.unpacked(), 5));
  }
  report::Figure roll;
  roll.x_label = "time (s)";
  roll.y_label = "roll sd (rad)";
  roll.height_px = 150;
  roll.link = "time";
  page.figure(roll.line("standard deviation", t_s, roll_sd_rad),
              "Roll is never measured itself: this is what the filter admits not to know of it.");
}

// What headings bring: the newest state with them and without, and whether they are what the filter takes them for.
void print_headings(std::ostream& out, const Replay& replay, const InnovationFigures& figures) {
  const estimator::ReadingCounters& c = replay.counters.headings;
  if (c.offered == 0) return;
  out << text_of(
      "  headings     %lld: %lld not usable, %lld too old, %lld duplicate, %lld late, %lld of %lld rejected\n",
      static_cast<long long>(c.offered), static_cast<long long>(c.not_usable), static_cast<long long>(c.too_old),
      static_cast<long long>(c.duplicate), static_cast<long long>(c.late),
      static_cast<long long>(figures.headings_rejected), static_cast<long long>(figures.headings));
  if (figures.heading_nis.degrees > 0)
    out << "  heading NIS  " << with_band(figures.heading_nis)
        << text_of("; %lld headings, %lld axes\n", static_cast<long long>(figures.headings - figures.headings_rejected),
                   static_cast<long long>(figures.heading_nis.degrees));
  if (!replay.without_headings) return;
  const auto print_spread = [&out](const char* name, const estimator::FilterState& s) {
    const Eigen::Vector3d spread = position_sd_mm(s);
    out << text_of(
        "  %s k %.6f +- %.6f /mm, lambda2 %.4f +- %.4f, tip +- %.3f %.3f %.3f mm, tilt +- %.4f %.4f, roll +- %.4f "
        "rad\n",
        name, s.curvature_per_mm, sd(s, 6), s.lambda2, sd(s, 8), spread.x(), spread.y(), spread.z(), sd(s, 3), sd(s, 4),
        sd(s, 5));
  };
  print_spread("with them   ", replay.states.back().state.unpacked());
  print_spread("without     ", replay.without_headings->state.unpacked());
  if (replay.truth_without_headings.count == 0) return;
  const TruthFigures& truth = replay.truth_without_headings;
  out << text_of(
      "  truth        without headings RMSE position %.3f mm, tilt %.4f rad, roll %.4f rad; pose NEES/6 %.3f\n",
      truth.position_rmse_mm, truth.tilt_rmse_rad, truth.roll_rmse_rad, truth.pose_nees.mean());
}

void print_predicted(std::ostream& out, const Predicted& next, const Predicted& ahead, double ahead_mm) {
  const auto times = [](const Predicted& f) { return static_cast<long long>(std::max(f.count[0], f.count[1])); };
  out << text_of("  predicted     lateral RMSE %.3f mm one measurement ahead (%lld), %.3f mm %g mm ahead (%lld)\n",
                 next.lateral_rmse_mm(), times(next), ahead.lateral_rmse_mm(), ahead_mm, times(ahead));
}

}  // namespace

void print(std::ostream& out, const Replay& replay, double ahead_mm) {
  const InnovationFigures figures = innovation_figures(replay);
  const estimator::ReadingCounters& c = replay.counters.positions;
  out << replay.name << "\n";
  out << text_of(
      "  messages     %lld actuator states (%lld refused), %lld measurements:\n"
      "               %lld not usable, %lld too old, %lld duplicate, %lld late\n",
      static_cast<long long>(replay.counters.actuators), static_cast<long long>(replay.counters.actuators_refused),
      static_cast<long long>(c.offered), static_cast<long long>(c.not_usable), static_cast<long long>(c.too_old),
      static_cast<long long>(c.duplicate), static_cast<long long>(c.late));
  if (c.in_gap > 0)
    out << text_of("  GAP          %lld measurements not applied: ACTUATOR_STATE had gaps of more than %g s\n",
                   static_cast<long long>(c.in_gap), replay.config.axes.gap_s);
  if (replay.refused_messages > 0)
    out << "  REFUSED      " << replay.refused_messages << " messages that do not decode\n";
  if (!replay.damage.intact()) out << "  DAMAGED LOG  " << replay.damage.describe() << "\n";
  if (replay.states.empty()) {
    out << "  no actuator state: nothing to estimate\n";
    return;
  }
  out << text_of("  gate         %lld of %lld rejected, %lld declared resets\n",
                 static_cast<long long>(figures.rejected), static_cast<long long>(figures.measurements),
                 static_cast<long long>(figures.resets));
  if (figures.nis.degrees > 0) out << "  NIS / axis   " << with_band(figures.nis) << "\n";
  for (std::size_t i = 0; i < 3; ++i) {
    if (figures.axis[i].degrees == 0) continue;
    const LjungBox& white = figures.whiteness[i];
    out << "  " << kAxisName[i] << "            " << with_band(figures.axis[i])
        << text_of("; Ljung-Box Q(%d) %.1f, p %.3g\n", white.lags, white.statistic, white.p_value);
  }
  const estimator::Prior& prior = replay.config.prior;
  out << text_of("  prior        k %.6f +- %.6f, lambda1 %.4f +- %.4f, lambda2 %.4f +- %.4f\n",
                 prior.needle.curvature_per_mm, prior.curvature_sd_per_mm, prior.needle.lambda1_per_rad,
                 prior.lambda1_sd_per_rad, prior.needle.lambda2, prior.lambda2_sd);
  const estimator::FilterState last = replay.states.back().state.unpacked();
  out << text_of("  k            %.6f +- %.6f /mm\n  lambda1      %.4f +- %.4f /rad\n  lambda2      %.4f +- %.4f\n",
                 last.curvature_per_mm, sd(last, 6), last.lambda1_per_rad, sd(last, 7), last.lambda2, sd(last, 8));
  if (prior.bending_mm > 0)
    out << text_of("  bending      %.2f +- %.2f mm, prior %.2f +- %.2f\n", last.bending_mm,
                   std::sqrt(last.tenth_variance), prior.bending_mm, prior.bending_sd_mm);
  if (prior.wheelbase_sd_mm > 0)
    out << text_of("  ell          %.2f +- %.2f mm, prior %.2f +- %.2f\n", last.wheelbase_mm,
                   std::sqrt(last.tenth_variance), prior.needle.wheelbase_mm, prior.wheelbase_sd_mm);
  const Eigen::Vector3d spread = position_sd_mm(last);
  out << text_of("  tip          %.3f %.3f %.3f +- %.3f %.3f %.3f mm, roll +- %.3f rad, %s\n", last.pose.p_mm.x(),
                 last.pose.p_mm.y(), last.pose.p_mm.z(), spread.x(), spread.y(), spread.z(), sd(last, 5),
                 estimator::describe_health(replay.states.back().health).c_str());
  if (replay.truth.count > 0) {
    out << text_of(
        "  truth        RMSE position %.3f mm (lateral %.3f), tilt %.4f rad, roll %.4f rad; last %.3f mm; %lld "
        "samples\n",
        replay.truth.position_rmse_mm, replay.truth.lateral_rmse_mm, replay.truth.tilt_rmse_rad,
        replay.truth.roll_rmse_rad, replay.truth.last_position_error_mm, static_cast<long long>(replay.truth.count));
    // One insertion's errors hang together over time, so a band for independent ones would not hold.
    out << text_of("  pose NEES/6  %.3f over the insertion (not independent samples)\n", replay.truth.pose_nees.mean());
    const auto& nees = replay.truth.axis_nees;
    out << text_of("  by itself    x %.2f, y %.2f, along the needle %.2f, tilts %.2f and %.2f, roll %.2f\n",
                   nees[0].mean(), nees[1].mean(), nees[2].mean(), nees[3].mean(), nees[4].mean(), nees[5].mean());
  }
  print_headings(out, replay, figures);
  print_predicted(out, replay.next, replay.ahead, ahead_mm);
}

void print_together(std::ostream& out, const std::vector<Replay>& replays, double ahead_mm) {
  ChiSquareMean nis, heading_nis;
  std::int64_t rejected = 0;
  std::int64_t measurements = 0;
  Predicted next, ahead;
  for (const Replay& replay : replays) {
    const InnovationFigures figures = innovation_figures(replay);
    nis.add(figures.nis.sum, figures.nis.degrees);
    heading_nis.add(figures.heading_nis.sum, figures.heading_nis.degrees);
    rejected += figures.rejected, measurements += figures.measurements;
    next.add(replay.next), ahead.add(replay.ahead);
  }
  out << text_of("%zu logs together\n  gate         %lld of %lld rejected\n", replays.size(),
                 static_cast<long long>(rejected), static_cast<long long>(measurements));
  if (nis.degrees > 0) out << "  NIS / axis   " << with_band(nis) << "\n";
  if (heading_nis.degrees > 0)
    out << "  heading NIS  " << with_band(heading_nis)
        << text_of("; %lld axes\n", static_cast<long long>(heading_nis.degrees));
  print_predicted(out, next, ahead, ahead_mm);
}

void print_speed(std::ostream& out, const std::vector<Replay>& replays) {
  double log_s = 0, run_s = 0, processor_s = 0;
  for (const Replay& r : replays) log_s += r.log_s, run_s += r.run_s, processor_s += r.processor_s;
  const auto times = [log_s](double s) { return s > 0 ? log_s / s : 0.0; };
  out << text_of(
      "%zu logs, %.1f s recorded, %.4f s decoding and estimating: %.0f times real time on one core (%.0f by processor "
      "time)\n",
      replays.size(), log_s, run_s, times(run_s), times(processor_s));
}

void write_files(const Replay& replay, const std::string& folder, double ahead_mm) {
  std::filesystem::create_directories(folder);
  const std::string stem = (std::filesystem::path(folder) / replay.name).string();
  write_csv(replay, stem);
  if (replay.states.size() < 2) return;
  report::Page page("Replay of " + replay.name);
  std::ostringstream summary;
  print(summary, replay, ahead_mm);
  page.heading("Figures")
      .code(summary.str())
      .heading("States with 2-sigma bands")
      .paragraph(
          "Blue: the estimate, its band two standard deviations wide to either side. Dots: measured. All figures are "
          "linked in time: point at one to read all of them, drag across one to look closer, double-click to go back.");
  add_state_figures(page, replay);
  page.save(stem + ".html");
}

}  // namespace bevel::analysis
