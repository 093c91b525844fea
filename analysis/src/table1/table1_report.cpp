// SPDX-License-Identifier: MIT
#include <bevel/analysis/table1/table1_report.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

#include <bevel/report/page.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)

namespace {

constexpr std::array<const char*, 2> kTissues = {"agar", "plastisol"};
constexpr double kForceLimit_N = 3.0;  // beyond physics.md's 0.2-1 N, to see what it would take
constexpr std::uint64_t kSeed = 20150928;

model::NeedleParameters table_needle(std::size_t tissue, model::FrontWheel wheel) {
  model::NeedleParameters n;  // k, ell inferred: physics.md, "The sign in print"
  n.lambda1_per_rad = tissue == 0 ? 0.49 : 0.144;
  n.lambda2 = tissue == 0 ? 0.22 : 0.032;
  n.front_wheel = wheel;
  return n;
}

double paper_mean_bicycle_mm(const char* tissue) {
  double sum = 0;
  int count = 0;
  for (const auto& row : paper_rows())
    if (row.tissue == tissue) {
      sum += row.largest_bicycle_mm;
      ++count;
    }
  return sum / count;
}

std::string text(const char* format, double value) {
  char out[32];
  std::snprintf(out, sizeof out, format, value);
  return out;
}

std::vector<std::vector<std::string>> rows_of(const std::vector<Tissue>& tissues) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& t : tissues)
    for (const auto& r : t.rows) {
      const auto paper = std::find_if(paper_rows().begin(), paper_rows().end(), [&](const PaperRow& p) {
        return p.tissue == t.path.tissue && p.speed_mm_s == r.speed_mm_s;
      });
      const auto& fit = t.fit;
      const bool bound = fit.find(kNeedleLambda1)->at_bound;
      rows.push_back({t.path.tissue, text("%.0f", r.speed_mm_s),
                      text("%.3f", paper->lambda1) + " / " + text("%.3f", paper->lambda2),
                      text("%.3f", fit.needle.lambda1_per_rad) + " / " + text("%.3f", fit.needle.lambda2) +
                          (bound ? " (bound)" : ""),
                      text("%.3f", fit.find(kNeedleLambda1)->std_error) + " / " +
                          text("%.3f", fit.find(kNeedleLambda2)->std_error),
                      text("%.3f", t.angle_rate.needle.lambda1_per_rad) + " / " +
                          text("%.3f", t.angle_rate.needle.lambda2) + (t.angle_rate.in_domain ? "" : " (out)"),
                      text("%.2f", paper->largest_extended_mm), text("%.2f", r.largest_extended_mm),
                      text("%.2f", r.largest_angle_rate_mm) + " / " + text("%.2f", r.largest_angle_rate_k_mm),
                      text("%.2f", paper->largest_bicycle_mm), text("%.2f", r.largest_bicycle_mm)});
    }
  return rows;
}
const std::vector<std::string> kHeader = {"tissue",
                                          "mm/s",
                                          "paper l1 / l2",
                                          "trajectory l1 / l2",
                                          "std. errors",
                                          "angle-rate l1 / l2",
                                          "ext paper",
                                          "ext traj.",
                                          "ext angle-rate, k held / free",
                                          "bicycle paper",
                                          "bicycle here"};

void print_rows(std::ostream& out, const std::vector<std::string>& header,
                const std::vector<std::vector<std::string>>& rows) {
  const auto line = [&](const std::vector<std::string>& cells) {
    out << '|';
    for (const auto& cell : cells) out << ' ' << cell << " |";
    out << '\n';
  };
  line(header);
  line(std::vector<std::string>(header.size(), "---"));
  for (const auto& row : rows) line(row);
}

std::vector<std::vector<std::string>> reach_rows(const Table1Study& study) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < 2; ++i)
    for (const auto& f : study.reach[i])
      rows.push_back({kTissues[i], text("%.0f", f.modulus_kPa), text("%.2f", f.at_1N_mm),
                      f.force_N >= kForceLimit_N - 0.01 ? "out of reach below " + text("%.0f", kForceLimit_N)
                                                        : text("%.2f", f.force_N),
                      text("%.1f", f.deflection_mm)});
  return rows;
}
const std::vector<std::string> kReachHeader = {"tissue", "modulus kPa", "bicycle error at 1 N, mm",
                                               "force for the paper's error, N", "deflection then, mm"};

report::Figure tissue_figure(const Tissue& t) {
  report::Figure figure;
  figure.title = t.path.tissue + ": " + t.path.description;
  figure.x_label = "depth (mm)";
  figure.y_label = "deflection (mm)";
  std::vector<double> z, y;
  for (const auto& o : t.rows[0].mean.observations) {
    z.push_back(o.position_mm.z());
    y.push_back(o.position_mm.y());
  }
  figure.points("mean of three trials", z, y, report::Colour::blue);
  const auto add = [&](const model::NeedleParameters& n, const char* label, report::Colour colour, bool dashed) {
    std::vector<double> zs, ys;
    for (const auto& p : straight_insertion(n, 200)) {
      if (p.z() > kDepth_mm) break;
      zs.push_back(p.z());
      ys.push_back(p.y());
    }
    dashed ? figure.dashed(label, zs, ys, colour) : figure.line(label, zs, ys, colour);
  };
  add(t.rows[0].circle, "bicycle", report::Colour::orange, true);
  add(t.rows[0].extended, "extended", report::Colour::green, false);
  return figure;
}

report::Figure error_figure(const Tissue& t) {
  report::Figure figure;
  figure.x_label = "depth (mm)";
  figure.y_label = "error of deflection (mm)";
  const auto& r = t.rows[0];
  std::vector<double> z;
  for (const auto& o : r.mean.observations) z.push_back(o.position_mm.z());
  figure.points("bicycle", z, path_errors_mm(r.mean, r.circle, Compare::same_depth), report::Colour::orange);
  figure.points("extended", z, path_errors_mm(r.mean, r.extended, Compare::same_depth), report::Colour::green);
  return figure;
}

report::Figure figure5() {
  report::Figure figure;
  figure.title = "Paths for several lambdas, one needle";
  figure.x_label = "depth (mm)";
  figure.y_label = "deflection (mm)";
  for (const auto& [l1, l2] : std::vector<std::pair<double, double>>{
           {0, 0}, {0.144, 0.032}, {0.3, 0.1}, {0.49, 0.22}, {0.49, 0.0}, {0.8, 0.22}, {0.49, -0.2}}) {
    model::NeedleParameters n;
    n.lambda1_per_rad = l1;
    n.lambda2 = l2;
    std::vector<double> z, y;
    for (const auto& p : straight_insertion(n, 130)) {
      z.push_back(p.z());
      y.push_back(p.y());
    }
    char label[48];
    std::snprintf(label, sizeof label, "%.3g, %.3g", l1, l2);
    figure.line(label, z, y);
  }
  return figure;
}

}  // namespace

Table1Study run_study(cli::ProgressLine& progress) {
  constexpr std::array kModuli_kPa{2.0, 5.0, 10.0, 20.0, 50.0, 100.0};
  Table1Study study;
  progress.begin("parts of the study", 2 * (kModuli_kPa.size() + 2));
  for (std::size_t i = 0; i < 2; ++i) {
    const auto published = kinematic_path(kTissues[i], table_needle(i, model::FrontWheel::published));
    study.kinematic.push_back(identify_tissue(published, kSeed + 100 * i));
    study.sign_mm[i] = {
        largest_circle_error_mm(published),
        largest_circle_error_mm(kinematic_path(kTissues[i], table_needle(i, model::FrontWheel::nonslip)))};
    progress.one_done();

    // The beam: at each modulus the force that gives the paper's bicycle error; of these the least force.
    const double wanted_mm = paper_mean_bicycle_mm(kTissues[i]);
    double best_modulus_kPa = 0;
    double best_force_N = 1e9;
    double best_off_mm = 1e9;
    for (const double modulus_kPa : kModuli_kPa) {
      const double force_N = force_for_error_N(modulus_kPa, wanted_mm, kForceLimit_N);
      const auto path = beam_path(kTissues[i], modulus_kPa, force_N);
      study.reach[i].push_back(
          {modulus_kPa, largest_circle_error_mm(beam_path("", modulus_kPa, 1.0)), force_N, -path.tip_mm.back().y()});
      progress.one_done();
      const double off_mm = std::max(std::abs(largest_circle_error_mm(path) - wanted_mm) - 0.05, 0.0);
      if (off_mm > best_off_mm || (off_mm == best_off_mm && force_N >= best_force_N)) continue;
      best_off_mm = off_mm;
      best_force_N = force_N;
      best_modulus_kPa = modulus_kPa;
    }
    study.beam.push_back(identify_tissue(beam_path(kTissues[i], best_modulus_kPa, best_force_N), kSeed + 100 * i + 50));
    progress.one_done();
  }
  progress.end();
  return study;
}

void print(std::ostream& out, const Table1Study& study) {
  out << "Table I on the kinematic plant with Table I's lambdas (seed " << kSeed << ")\n";
  print_rows(out, kHeader, rows_of(study.kinematic));
  out << "\nTable I on the beam plant, tuned by stiffness and bevel force to the paper's bicycle error\n";
  for (const auto& t : study.beam)
    out << t.path.tissue << ": " << t.path.description << "; fitted k " << t.fit.needle.curvature_per_mm << '\n';
  print_rows(out, kHeader, rows_of(study.beam));
  out << "\nA bicycle whose entry may be tilted, nothing else (largest error over all trials, noise included):\n";
  for (const auto* tissues : {&study.kinematic, &study.beam})
    for (const auto& t : *tissues)
      out << t.path.description << ": tilt " << text("%.3f", t.tilted_bicycle.entries[0](kEntryTiltX)) << " rad, k "
          << text("%.5f", t.tilted_bicycle.needle.curvature_per_mm) << " /mm, RMS "
          << text("%.2f", t.tilted_error.rms_mm) << ", largest " << text("%.2f", t.tilted_error.largest_mm)
          << " mm; extended RMS "
          << text("%.2f", error_figures({t.rows[0].mean, t.rows[1].mean}, t.fit.needle, Compare::same_depth).rms_mm)
          << " mm (of the means)\n";
  out << "\nWhat the beam needs for the paper's bicycle error\n";
  print_rows(out, kReachHeader, reach_rows(study));
  out << "\nThe sign: largest circle error of Table I's lambdas at ell 20 mm, k 0.0047 /mm: published "
      << text("%.2f", study.sign_mm[0][0]) << " (agar), " << text("%.2f", study.sign_mm[1][0])
      << " (plastisol); nonslip " << text("%.2f", study.sign_mm[0][1]) << ", " << text("%.2f", study.sign_mm[1][1])
      << "; the paper's mean 3.64, 1.11 mm\n";
}

// Of a plant's columns (kHeader) in two tables, as all eleven of them are too wide for a page.
void add_tables(report::Page& page, const std::vector<Tissue>& tissues) {
  std::vector<std::vector<std::string>> slip, errors;
  for (const auto& row : rows_of(tissues)) {
    slip.emplace_back(row.begin(), row.begin() + 6);
    errors.push_back({row[0], row[1]});
    errors.back().insert(errors.back().end(), row.begin() + 6, row.end());
  }
  page.table(
      {"tissue", "speed (mm/s)", "in the paper", "fitted to the path", "its standard errors", "by the angle's rate"},
      slip, "lambda1 (1/rad) / lambda2: printed, fitted to paths, and by the paper's way from angle rates.");
  page.table({"tissue", "speed (mm/s)", "extended, paper", "extended, fitted to the path",
              "extended, by the angle's rate: k held / free", "bicycle, paper", "bicycle, here"},
             errors, "Largest error of each model (mm), k being the curvature.");
}

void save_report(const Table1Study& study, const std::string& path) {
  report::Page page("Table I, reproduced");
  page.paragraph(
      "130 mm of depth, three trials, 30 Hz camera above, tip noise 0.2 mm; errors of the mean of three trials "
      "against the model at the same depth. Wheelbase 20 mm and curvature 0.0047 /mm are inferred, the paper "
      "prints neither. Lambdas are fitted over both speeds at once, as in the paper.");
  page.heading("Kinematic plant with Table I's lambdas");
  add_tables(page, study.kinematic);
  page.heading("Beam plant, tuned by stiffness and bevel force only");
  add_tables(page, study.beam);
  page.table(kReachHeader, reach_rows(study), "What the beam needs for the paper's bicycle error.");
  page.heading("Figure 5")
      .figure(figure5(), "Published front wheel, ell 20 mm, k 0.0047 /mm; lambda1, lambda2 in the legend.");
  for (const auto* tissues : {&study.kinematic, &study.beam})
    for (std::size_t i = 2; i-- > 0;) {
      const auto& t = (*tissues)[i];
      page.heading(std::string(i == 1 ? "Figure 7: plastisol, " : "Figure 8: agar, ") +
                   (tissues == &study.kinematic ? "kinematic plant" : "beam plant"));
      page.figure(tissue_figure(t), "Mean of three trials, the bicycle's circle and the extended model.");
      page.figure(error_figure(t), "Their errors at the same depth.");
    }
  page.save(path);
}

}  // namespace bevel::analysis
