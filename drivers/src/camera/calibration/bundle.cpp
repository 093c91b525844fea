// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/calibration/bundle.hpp>

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <memory>

#include <bevel/error.hpp>

namespace bevel::camera {
namespace {

// Parameters as Ceres holds them: k3 and the index apart from the rest, since they may be held alone.
struct Blocks {
  struct Camera {
    std::array<double, kK3> lens{};
    double k3 = 0.0;
    std::array<double, 6> from_first{};
    std::array<double, kIndex> wall{};
  };
  std::vector<Camera> cameras;
  std::vector<Pose> boards;
  double index = 1.333;

  explicit Blocks(const Rig& rig) : boards(rig.boards) {
    for (size_t c = 0; c < rig.lenses.size(); ++c) {
      Camera camera;
      std::copy_n(rig.lenses[c].parameters.begin(), kK3, camera.lens.begin());
      camera.k3 = rig.lenses[c].parameters[kK3];
      camera.from_first = rig.from_first[c].parameters;
      if (rig.walls[c]) {
        std::copy_n(rig.walls[c]->parameters.begin(), kIndex, camera.wall.begin());
        index = rig.walls[c]->parameters[kIndex];
      }
      cameras.push_back(camera);
    }
  }
  void store(Rig& rig) const {
    for (size_t c = 0; c < cameras.size(); ++c) {
      std::copy(cameras[c].lens.begin(), cameras[c].lens.end(), rig.lenses[c].parameters.begin());
      rig.lenses[c].parameters[kK3] = cameras[c].k3;
      rig.from_first[c].parameters = cameras[c].from_first;
      if (!rig.walls[c]) continue;
      std::copy(cameras[c].wall.begin(), cameras[c].wall.end(), rig.walls[c]->parameters.begin());
      rig.walls[c]->parameters[kIndex] = index;
    }
    rig.boards = boards;
  }
};

template <class T>
void move(const T* pose, const T* from, T* to) {
  ceres::AngleAxisRotatePoint(pose, from, to);
  for (int i = 0; i < 3; ++i) to[i] += pose[3 + i];
}

// One corner in one picture, seen less fitted, px.
struct Corner {
  cv::Vec3d board_mm;
  cv::Point2d seen_px;

  template <class T>
  bool compare(const T* lens8, const T* k3, const T* direction, T* residual) const {
    T lens[kLensParameters];
    std::copy_n(lens8, kK3, lens);
    lens[kK3] = *k3;
    T pixel[2];
    if (!direction_to_pixel(lens, direction, pixel)) return false;
    residual[0] = seen_px.x - pixel[0];
    residual[1] = seen_px.y - pixel[1];
    return true;
  }
  template <class T>
  void place(const T* camera, const T* board, T* p_C) const {
    const T p_B[3] = {T(board_mm[0]), T(board_mm[1]), T(board_mm[2])};
    T p_C0[3];
    move(board, p_B, p_C0);
    move(camera, p_C0, p_C);
  }
};

struct InAir : Corner {
  template <class T>
  bool operator()(const T* lens, const T* k3, const T* camera, const T* board, T* residual) const {
    T p_C[3];
    place(camera, board, p_C);
    return compare(lens, k3, p_C, residual);
  }
};

struct Immersed : Corner {
  Pane pane;
  template <class T>
  bool operator()(const T* lens, const T* k3, const T* camera, const T* board, const T* wall3, const T* index,
                  T* residual) const {
    T p_C[3], direction[3];
    place(camera, board, p_C);
    const T wall[kWallParameters] = {wall3[0], wall3[1], wall3[2], *index};
    return direction_through_wall(wall, pane, p_C, direction) && compare(lens, k3, direction, residual);
  }
};

ceres::Problem::Options keeping_the_loss() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

struct Problem {
  std::unique_ptr<ceres::LossFunction> huber;  // shared by all residuals; none is least squares
  ceres::Problem ceres{keeping_the_loss()};
  int residuals = 0;

  Problem(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, double loss_px, const Rig& rig,
          Blocks& blocks) {
    if (loss_px > 0.0) huber = std::make_unique<ceres::HuberLoss>(loss_px);
    ceres::LossFunction* const loss = huber.get();
    bool any_immersed = false;
    for (size_t s = 0; s < shots.size(); ++s)
      for (size_t c = 0; c < shots[s].seen.size(); ++c)
        for (size_t i = 0; i < shots[s].seen[c].ids.size(); ++i) {
          Blocks::Camera& camera = blocks.cameras[c];
          double* const pose = blocks.boards[s].parameters.data();
          const Corner corner{board.corner_mm(shots[s].seen[c].ids[i]), shots[s].seen[c].px[i]};
          if (shots[s].immersed) {
            any_immersed = true;
            auto* cost = new ceres::AutoDiffCostFunction<Immersed, 2, 8, 1, 6, 6, 3, 1>(
                new Immersed{corner, rig.walls[c]->pane});
            ceres.AddResidualBlock(cost, loss, camera.lens.data(), &camera.k3, camera.from_first.data(), pose,
                                   camera.wall.data(), &blocks.index);
          } else {
            auto* cost = new ceres::AutoDiffCostFunction<InAir, 2, 8, 1, 6, 6>(new InAir{corner});
            ceres.AddResidualBlock(cost, loss, camera.lens.data(), &camera.k3, camera.from_first.data(), pose);
          }
          residuals += 2;
        }
    const auto hold = [&](double* block) {
      if (ceres.HasParameterBlock(block)) ceres.SetParameterBlockConstant(block);
    };
    hold(blocks.cameras.front().from_first.data());
    if (!options.fit_k3)
      for (auto& camera : blocks.cameras) hold(&camera.k3);
    if (any_immersed && !options.fit_index) hold(&blocks.index);
  }

  int free_parameters() const {
    std::vector<double*> all;
    ceres.GetParameterBlocks(&all);
    int count = 0;
    for (double* block : all)
      if (!ceres.IsParameterBlockConstant(block)) count += ceres.ParameterBlockSize(block);
    return count;
  }
};

void solve(ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-10;
  options.parameter_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) throw DomainError("the fit of the boards failed: " + summary.message);
}

}  // namespace

cv::Matx33d Pose::R() const {
  double column_major[9];
  ceres::AngleAxisToRotationMatrix(parameters.data(), column_major);
  return cv::Matx33d(column_major).t();
}

Pose Pose::from(const cv::Matx33d& R, const cv::Vec3d& t_mm) {
  Pose pose;
  const cv::Matx33d column_major = R.t();
  ceres::RotationMatrixToAngleAxis(column_major.val, pose.parameters.data());
  std::copy_n(t_mm.val, 3, &pose.parameters[3]);
  return pose;
}

Pose Pose::inverse() const { return from(R().t(), -(R().t() * t_mm())); }

Pose operator*(const Pose& a, const Pose& b) { return Pose::from(a.R() * b.R(), a(b.t_mm())); }

CameraModel camera_in(const Rig& rig, size_t c, bool immersed) {
  CameraModel model;
  model.lens = rig.lenses[c];
  model.R_CA = rig.from_first[c].R();
  model.p_CA_mm = rig.from_first[c].t_mm();
  if (immersed) model.wall = rig.walls[c];
  return model;
}

std::vector<Residual> residuals_of(const Board& board, const std::vector<Shot>& shots, const Rig& rig) {
  std::vector<Residual> out;
  for (size_t c = 0; c < rig.lenses.size(); ++c)
    for (size_t s = 0; s < shots.size(); ++s) {
      const Sighting& seen = shots[s].seen[c];
      if (seen.ids.empty()) continue;
      const CameraModel model = camera_in(rig, c, shots[s].immersed);
      for (size_t i = 0; i < seen.ids.size(); ++i) {
        const auto fitted = model.pixel(rig.boards[s](board.corner_mm(seen.ids[i])));
        const cv::Point2d none(1e3, 1e3);  // the fit has it where the camera cannot see: as wrong as can be
        out.push_back({c, s, i, seen.px[i], fitted ? seen.px[i] - *fitted : none});
      }
    }
  return out;
}

double rms(const std::vector<Residual>& residuals) {
  double squares = 0.0;
  for (const Residual& r : residuals) squares += r.seen_less_fitted_px.dot(r.seen_less_fitted_px);
  return residuals.empty() ? 0.0 : std::sqrt(squares / static_cast<double>(residuals.size()));
}

void fit_rig(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, double loss_px, Rig& rig) {
  Blocks blocks(rig);
  Problem problem(board, shots, options, loss_px, rig, blocks);
  solve(problem.ceres);
  blocks.store(rig);
}

RigSd deviations(const Board& board, const std::vector<Shot>& shots, const FitOptions& options, const Rig& rig) {
  Blocks blocks(rig);
  Problem problem(board, shots, options, 0.0, rig, blocks);
  std::vector<std::pair<const double*, const double*>> wanted;
  const auto want = [&](const double* block) {
    if (problem.ceres.HasParameterBlock(block) && !problem.ceres.IsParameterBlockConstant(block))
      wanted.emplace_back(block, block);
  };
  for (const auto& camera : blocks.cameras) {
    want(camera.lens.data());
    want(&camera.k3);
    want(camera.from_first.data());
    want(camera.wall.data());
  }
  want(&blocks.index);
  ceres::Covariance::Options how;
  how.algorithm_type = ceres::SPARSE_QR;
  ceres::Covariance covariance(how);
  const int spare = problem.residuals - problem.free_parameters();
  if (spare <= 0 || !covariance.Compute(wanted, &problem.ceres))
    throw DomainError(
        "the pictures leave something of the cameras undetermined; more of them are needed, with the board turned by "
        "20 to "
        "40 degrees to all sides and at several distances");
  double cost = 0.0;
  problem.ceres.Evaluate({}, &cost, nullptr, nullptr, nullptr);
  const double scale = std::sqrt(2.0 * cost / spare);
  const auto read = [&](const double* block, int size, double* sd) {
    if (!problem.ceres.HasParameterBlock(block) || problem.ceres.IsParameterBlockConstant(block)) return;
    cv::Mat_<double> all(size, size);
    covariance.GetCovarianceBlock(block, block, all.ptr<double>());
    for (int i = 0; i < size; ++i) sd[i] = scale * std::sqrt(all(i, i));
  };
  RigSd out;
  for (auto& camera : blocks.cameras) {
    read(camera.lens.data(), kK3, out.lens.emplace_back().data());
    read(&camera.k3, 1, &out.lens.back()[kK3]);
    read(camera.from_first.data(), 6, out.from_first.emplace_back().data());
    read(camera.wall.data(), kIndex, out.wall.emplace_back().data());
    read(&blocks.index, 1, &out.wall.back()[kIndex]);
  }
  return out;
}

void fit_board(const Board& board, const Shot& shot, const Rig& rig, int parity, Pose& pose) {
  Shot part{shot.name, shot.immersed, std::vector<Sighting>(shot.seen.size())};
  for (size_t c = 0; c < shot.seen.size(); ++c)
    for (size_t i = 0; i < shot.seen[c].ids.size(); ++i)
      if (parity < 0 || shot.seen[c].ids[i] % 2 == parity) {
        part.seen[c].ids.push_back(shot.seen[c].ids[i]);
        part.seen[c].px.push_back(shot.seen[c].px[i]);
      }
  Rig alone = rig;
  alone.boards = {pose};
  Blocks blocks(alone);
  Problem problem(board, {part}, {}, 0.0, rig, blocks);
  std::vector<double*> all;
  problem.ceres.GetParameterBlocks(&all);
  for (double* block : all)
    if (block != blocks.boards.front().parameters.data()) problem.ceres.SetParameterBlockConstant(block);
  solve(problem.ceres);
  pose = blocks.boards.front();
}

}  // namespace bevel::camera
