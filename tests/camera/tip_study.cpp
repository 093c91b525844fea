// SPDX-License-Identifier: MIT
// Errors of the tip in rendered pictures, one effect at a time: tip_study [FRAMES_OF_EACH] [SEED]. Errors in px of 0.2
// mm.
#include <cstdio>
#include <cstdlib>

#include "tests/camera/effects.hpp"

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 200;
  const auto seed = static_cast<uint64_t>(argc > 2 ? std::atoll(argv[2]) : 20261123);
  if (frames < 1) {
    std::fprintf(stderr, "usage: tip_study [FRAMES_OF_EACH] [SEED]\n");
    return 2;
  }
  std::printf(
      "%d frames of each, seed %llu, px of 0.2 mm\n| effect | ok | across 50, 95 %%, largest | along 50, 95 %%, "
      "largest | along, mean mm | squared / 2 | beyond 6 px and ok |\n| --- | --- | --- | --- | --- | --- | --- |\n",
      frames, static_cast<unsigned long long>(seed));
  for (const auto& effect : bevel::test::effects()) {
    const auto f = bevel::test::stand(effect, frames, seed);
    const auto at = [](const std::vector<double>& values, double share) {
      return bevel::test::size_below(values, share);
    };
    std::printf("| %s | %d | %.2f, %.2f, %.2f | %.2f, %.2f, %.2f | %+.3f | %.2f | %d |\n", effect.name, f.ok,
                at(f.across_px, 0.5), at(f.across_px, 0.95), at(f.across_px, 1.0), at(f.along_px, 0.5),
                at(f.along_px, 0.95), at(f.along_px, 1.0), 0.2 * f.bias_along_px, f.squared, f.beyond_6_px);
  }
  return 0;
}
