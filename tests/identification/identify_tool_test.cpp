// bevel-identify from logs on disk to its files.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/log_writer.hpp"
#include "io/messages.hpp"
#include "io/model_file.hpp"
#include "tests/identification/simulated_insertion.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/identify/identify.hpp"

namespace bevel::identify {
namespace {

namespace fs = std::filesystem;

struct IdentifyTool : ::testing::Test {
  test::TemporaryFolder folder;
  model::NeedleParameters truth;
  Options options;

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
  EXPECT_EQ(figures["candidates"].size(), 5U);
  EXPECT_GT(fs::file_size(options.out_folder + "/report.html"), 20000U);  // with pictures
  EXPECT_NE(out.str().find("extended, isotropic, published"), std::string::npos);
}

TEST_F(IdentifyTool, MethodsAndPriorsAreHeard) {
  const auto plain = identify(options, std::cerr);
  options.prior = "table1-plastisol";
  const auto with_prior = identify(options, std::cerr);
  EXPECT_GT(with_prior.fit.find(diagnosis::kLambda1)->prior_share, 0);
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
}  // namespace bevel::identify
