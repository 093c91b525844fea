// SPDX-License-Identifier: MIT
#include "proof/commitment.hpp"

#include <gmock/gmock.h>

namespace bevel::proof {
namespace {

// FIPS 180-4, examples.
TEST(Commitment, IsSha256) {
  EXPECT_EQ(io::sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(io::sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(commitment_to("a", "bc"), io::sha256_hex("abc"));
}

TEST(Commitment, SaltsAreLongAndDiffer) {
  const std::string salt = draw_salt();
  EXPECT_EQ(salt.size(), 64U);
  EXPECT_NE(salt, draw_salt());
}

TEST(Commitment, AMissingFileIsNamed) {
  EXPECT_THAT([] { io::sha256_of_file("/nowhere/at-all"); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("/nowhere/at-all")));
}

}  // namespace
}  // namespace bevel::proof
