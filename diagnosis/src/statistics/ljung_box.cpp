// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/statistics/ljung_box.hpp>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>

namespace bevel::diagnosis {

LjungBox ljung_box(const Eigen::Ref<const Eigen::VectorXd>& series, int lags, int fitted) {
  LjungBox result;
  result.lags = lags;
  if (series.size() <= lags) return result;
  const auto n = static_cast<double>(series.size());
  const Eigen::VectorXd centred = series.array() - series.mean();
  const double variance = centred.squaredNorm();
  if (!(variance > 0)) return result;
  for (int lag = 1; lag <= lags; ++lag) {
    const double r = centred.head(series.size() - lag).dot(centred.tail(series.size() - lag)) / variance;
    result.statistic += r * r / (n - lag);
  }
  result.statistic *= n * (n + 2);
  const boost::math::chi_squared white(std::max(lags - fitted, 1));
  result.p_value = boost::math::cdf(boost::math::complement(white, result.statistic));
  return result;
}

}  // namespace bevel::diagnosis
