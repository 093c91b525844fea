// SPDX-License-Identifier: MIT
// The seed of a campaign: from a file, from the campaign, or random.
#include "proof/seed.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <stdexcept>

#include "tests/support/temporary_folder.hpp"

namespace bevel::proof {
namespace {

TEST(Seed, IsReadFromAFile) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(seed_of(folder.write("seed", "2026\n"), folder.path()), 2026U);
  EXPECT_EQ(seed_of(folder.write("seed", "9223372036854775807"), folder.path()), 9223372036854775807U);
  for (const char* text : {"", "-1", "1.5", "seed", "1 2", "9223372036854775808"})
    EXPECT_THAT([&] { seed_of(folder.write("seed", text), folder.path()); },
                testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("allowed: one whole number from 0 to")))
        << text;
  EXPECT_THROW(seed_of((folder / "none").string(), folder.path()), std::runtime_error);
}

TEST(Seed, OfACampaignIsKeptAndOtherwiseRandom) {
  const test::TemporaryFolder folder;
  std::set<std::uint64_t> seeds;
  for (int i = 0; i < 20; ++i) seeds.insert(seed_of("", folder.path()));
  EXPECT_EQ(seeds.size(), 20U);
  folder.write("campaign.json", "{\"seed\": 77}");
  EXPECT_EQ(seed_of("", folder.path()), 77U);
}

TEST(Seed, IsRefusedOnTheCommandLine) {
  const std::string program = std::string(BEVEL_BINARY_DIR) + "/bin/bevel-blindtrial";
  EXPECT_EQ(std::system((program + " --seed 3 --out /nonexistent --generate-only 2>/dev/null").c_str()), 2 << 8);
}

}  // namespace
}  // namespace bevel::proof
