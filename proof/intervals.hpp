// SPDX-License-Identifier: MIT
#pragma once
// How sure a share counted in few trials is.
namespace bevel::proof {

struct Share {
  int hits = 0;
  int of = 0;
  void add(bool hit) {
    hits += hit ? 1 : 0;
    ++of;
  }
  double value() const { return of > 0 ? static_cast<double>(hits) / of : 0.0; }
};

struct Interval {
  double low;
  double high;
};

Interval wilson95(const Share& share);               // two-sided; (0, 1) of no trials
Interval clopper_pearson95(const Share& share);      // two-sided, never too narrow
double clopper_pearson_upper95(const Share& share);  // one-sided: 0 of 59 gives just under 0.05

}  // namespace bevel::proof
