// SPDX-License-Identifier: MIT
// bevel-identify from logs on disk to its files.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <bevel/analysis/convert/import.hpp>
#include <bevel/analysis/identify/identify.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/model_file.hpp>
#include "tests/identification/simulated_insertion.hpp"
#include "tests/support/shared_recordings.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;

struct IdentifyTool : ::testing::Test {
  test::TemporaryFolder folder;
  model::NeedleParameters truth;
  IdentifyOptions options;

  void SetUp() override {
    truth.lambda1_per_rad = 0.49;
    truth.lambda2 = 0.22;
    auto start = truth;
    start.curvature_per_mm = 0.004;
    start.lambda1_per_rad = 0.2;
    start.lambda2 = 0.05;
    io::save_model_file({start, {}}, (folder / "start.toml").string());
    std::mt19937_64 random(5);
    for (int i = 0; i < 4; ++i) {
      const std::string path = (folder / ("rec" + std::to_string(i) + ".lcm")).string();
      io::LogWriter log(path);
      const auto recording = diagnosis::simulate(truth, {}, random);
      for (const auto& a : recording.actuators)
        log.write_message(a.utime, io::channel::kActuatorState, io::to_message(a));
      for (const auto& t : recording.tips) log.write_message(t.utime, io::channel::kTipMeasurement, io::to_message(t));
      log.close();
      options.logs.push_back(path);
    }
    options.model_path = (folder / "start.toml").string();
    options.out_folder = (folder / "out").string();
    options.fit_slip_in_plane = true;  // the simulated recordings follow the model to the noise
  }
};

TEST_F(IdentifyTool, WritesAModelThatOtherProgramsAcceptAndFiguresToMatch) {
  std::ostringstream out;
  ASSERT_EQ(run(options, out, std::cerr), 0) << out.str();
  const auto needle = io::load_model_file(options.out_folder + "/model.toml").needle;
  std::ifstream file(options.out_folder + "/figures.json");
  const auto figures = nlohmann::json::parse(file);
  const auto& l1 = figures["parameters"]["lambda1_per_rad"];
  EXPECT_DOUBLE_EQ(l1["value"].get<double>(), needle.lambda1_per_rad);
  EXPECT_NEAR(needle.lambda1_per_rad, truth.lambda1_per_rad, 4 * l1["std_error"].get<double>());
  EXPECT_EQ(figures["candidates"].size(), 7U);
  EXPECT_GT(fs::file_size(options.out_folder + "/report.html"), 20000U);  // with pictures
  EXPECT_NE(out.str().find("extended, isotropic, published"), std::string::npos);
}

// One selection: the row of the table, the text, figures.json and the model file are of the same candidate.
TEST_F(IdentifyTool, WritesTheSelectedModelAndNoErrorOfAParameterThatIsNotDetermined) {
  options.fit_slip_in_plane = false;
  for (const bool bicycle : {false, true}) {
    options.bicycle = bicycle;
    std::ostringstream out;
    ASSERT_EQ(run(options, out, std::cerr), 0) << out.str();
    const auto needle = io::load_model_file(options.out_folder + "/model.toml").needle;
    std::ifstream file(options.out_folder + "/figures.json");
    const auto figures = nlohmann::json::parse(file);
    int selected = 0;
    for (const auto& c : figures["candidates"]) {
      if (!c["selected"].get<bool>()) continue;
      ++selected;
      EXPECT_EQ(c["needle"]["curvature_per_mm"].get<double>(), needle.curvature_per_mm);
      EXPECT_EQ(c["needle"]["lambda1_per_rad"].get<double>(), needle.lambda1_per_rad);
      EXPECT_NE(out.str().find("selected and written: " + c["model"].get<std::string>() + "\n"), std::string::npos);
      EXPECT_NE(out.str().find(c["model"].get<std::string>() + " *"), std::string::npos);
      if (bicycle) {
        EXPECT_EQ(c["model"], "bicycle");
      }
      for (const auto& other : figures["candidates"])
        if (!bicycle && other["possible"].get<bool>()) {
          EXPECT_LE(c["bic"].get<double>(), other["bic"].get<double>() + 1e-3);
        }
    }
    EXPECT_EQ(selected, 1);
    EXPECT_NE(out.str().find("lambda1_per_rad is NOT DETERMINED by these recordings: the shaft rotates by 0 rad"),
              std::string::npos);
    if (needle.lambda1_per_rad == 0) continue;
    EXPECT_EQ(needle.lambda1_per_rad, 0.2) << "the value of the start";
    EXPECT_EQ(figures["parameters"]["lambda1_per_rad"]["determined"], false);
    EXPECT_TRUE(figures["parameters"]["lambda1_per_rad"]["std_error"].is_null());
  }
}

// Three insertions of a bent-tip needle at 1 mm/s, measured by others: constant curvature of 0.0120 to 0.0125 /mm.
TEST(IdentifyRealInsertions, CurvatureOfANeedleThatNeverRotates) {
  const fs::path real = test::shared_recordings() / "real/ultrasteer";
  BEVEL_SKIP_WITHOUT(real);
  test::TemporaryFolder folder;
  for (const std::string set : {"aligned", "csv"})
    for (const std::string map : {"ultrasteer.toml", "ultrasteer_pos.toml"}) {
      const std::string logs = (folder / (set + map)).string();
      analysis::ImportOptions import;
      import.map_path = (real / map).string(), import.out_folder = logs;
      for (int i = 1; i <= 3; ++i)
        import.inputs.push_back((real / set / "1mm" / ("trial" + std::to_string(i) + ".csv")).string());
      ::testing::internal::CaptureStdout();
      const int status = analysis::run(import);
      ::testing::internal::GetCapturedStdout();
      ASSERT_EQ(status, 0);
      for (const auto& [lambda1, lambda2] : {std::pair{0.49, 0.22}, {0.144, 0.032}, {0.0, 0.0}}) {
        model::NeedleParameters start;
        start.curvature_per_mm = 0.012, start.wheelbase_mm = 20;
        start.lambda1_per_rad = lambda1, start.lambda2 = lambda2;
        IdentifyOptions options;
        options.logs = {logs}, options.model_path = (folder / "start.toml").string();
        io::save_model_file({start, {}}, options.model_path);
        const Identification r = identify(options, std::cerr);
        EXPECT_GT(r.chosen.curvature_per_mm, 0.9 * 0.012) << set << ' ' << map << ' ' << lambda1;
        EXPECT_LT(r.chosen.curvature_per_mm, 1.1 * 0.013) << set << ' ' << map << ' ' << lambda1;
        EXPECT_EQ(r.chosen, r.candidates[diagnosis::preferred(r.candidates)].fit.needle);
      }
    }
}

TEST_F(IdentifyTool, MethodsAndPriorsAreHeard) {
  const auto plain = identify(options, std::cerr);
  options.prior = "table1-plastisol";
  const auto with_prior = identify(options, std::cerr);
  EXPECT_GT(with_prior.fit.find(diagnosis::kNeedleLambda1)->prior_share, 0);
  EXPECT_LT(with_prior.chosen.lambda1_per_rad, plain.chosen.lambda1_per_rad);
  options.method = "angle-rate";
  const auto rate = identify(options, std::cerr);
  EXPECT_EQ(rate.chosen, rate.angle_rate.needle);
}

TEST_F(IdentifyTool, AModelWithEffectsIsRefusedByName) {
  io::ModelFile file{truth, {{"torsional_windup", {{"lag_at_100mm_rad", 0.6}}}}};
  io::save_model_file(file, options.model_path);
  try {
    identify(options, std::cerr);
    FAIL() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("torsional_windup"), std::string::npos);
  }
}

TEST_F(IdentifyTool, AModelThatSaysWhatIsUncertainIsRefused) {
  const auto refusal = [&](const io::ModelFile& file) -> std::string {
    io::save_model_file(file, options.model_path);
    try {
      identify(options, std::cerr);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  };
  io::ModelFile file{truth};
  file.variation = model::Variation{.roll_rad = 0.1};
  EXPECT_NE(refusal(file).find("has [variation]"), std::string::npos);
  file.discrepancies = {{model::DiscrepancyComponent::advance, model::Covariate::depth_mm, {0}, {0.1}, {0.1}}};
  EXPECT_NE(refusal(file).find("has [[discrepancy]] in \"advance\""), std::string::npos);
}

}  // namespace
}  // namespace bevel::analysis
