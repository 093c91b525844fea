// SPDX-License-Identifier: MIT
// The needle in agar, Table I.
#pragma once

#include <bevel/model/needle.hpp>

namespace bevel::controller {

inline model::NeedleParameters agar() {
  model::NeedleParameters needle;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}

}  // namespace bevel::controller
