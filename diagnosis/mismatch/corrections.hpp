#pragma once
// Physics without a name: the motion is off by a broken line of some covariate. One correction per pair of component
// (curvature, advance, turning, drift of the tip; the cameras' axes) and covariate, each an Effect like those of the
// library, so that it is fitted, tested and held against chance by the same code; none of them is in the registry.
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/mismatch/dictionary.hpp"
#include "diagnosis/mismatch/findings.hpp"

namespace bevel::diagnosis {

class CorrectionLibrary {
 public:
  // Knots from the range that each covariate takes in the recordings; one that hardly varies is left out.
  explicit CorrectionLibrary(const RecordedCase& recorded);

  std::vector<Member> members() const;
  // The fitted correction as data. `member` is the index of it in the fit's set.
  Correction describe(const Fit& fit, std::size_t member) const;

 private:
  std::deque<std::string> names_;
  std::vector<std::unique_ptr<model::Effect>> effects_;
};

bool is_correction(const Member& member);

}  // namespace bevel::diagnosis
