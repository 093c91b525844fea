#pragma once
// What the freedom of a set of effects is worth, in chi2: a name that can take many values explains noise, and other
// physics, more easily than one that cannot.
//
// Problem   of sets that fit about equally well, which is likelier? The more a set's parameters could have been
//           anything, the less it foretold what was measured.
// Solution  Laplace's approximation of the marginal likelihood (MacKay 2003, ch. 28):
//             -2 ln p(readings | set) = chi2 + ln |I + P C^-1| + surprise
//           with C the covariance of the members' parameters, the needle's integrated out, and P that of what may be
//           expected of them: of a size, what the field reports (EffectParameter::reported; beyond it the surprise
//           grows with the logarithm, Student's t) or as likely any order of magnitude below that; of a depth or a
//           frequency, where fits look for it; of a curve, a smooth one of a scale that could have been of any order
//           of magnitude below the one that it was found to have (integrated over).
#include "diagnosis/mismatch/likelihood.hpp"

namespace bevel::diagnosis {

// In chi2, over all members; instants apart (kInstantCost). Zero for no effect.
double price_of_freedom(const Fit& fit);

// The inverse of P for the knots of a fit's curves, zero for all else; rows and columns as Hypothesis::unknowns.
Eigen::MatrixXd precision_of_curves(const Fit& fit);

}  // namespace bevel::diagnosis
