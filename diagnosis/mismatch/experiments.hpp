#pragma once
// What to record next: of a list of safe motions, the one in which two explanations would differ most, the rival's own
// parameters refitted; or in which an effect that these recordings cannot show would show.
#include "diagnosis/mismatch/findings.hpp"
#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

struct MotionScript {
  std::string text;  // what to command, in words
  model::Motion motion;
};
// Insertions of at most depth_mm, at most 10 mm/s and 2 pi rad/s; readings every frame_s.
std::vector<MotionScript> motion_scripts(double depth_mm, double frame_s);

// Expected fall of chi2 from `rival` to `truth` in one recording of the script.
double separation(const Evidence& evidence, const MotionScript& script, const Fit& truth, const Fit& rival);

NextExperiment best_experiment(const Evidence& evidence, const Fit& truth, const Fit& rival, double depth_mm);

}  // namespace bevel::diagnosis
