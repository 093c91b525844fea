// SPDX-License-Identifier: MIT
// Warnings about LCM providers, before a program that uses one starts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include <bevel/nodes/open_lcm.hpp>

namespace bevel::nodes {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(LcmUrl, ATtlAboveOneIsReported) {
  for (const char* url : {"udpm://239.255.76.67:7667?ttl=2", "udpm://239.255.76.67:7667?recv_buf_size=9&ttl=255"})
    EXPECT_THAT(lcm_url_warning(url), AllOf(StartsWith("LCM provider is " + std::string(url) + ": with ttl "),
                                            HasSubstr("allowed without this warning: 0"), HasSubstr("Set ttl=1")));
  for (const char* url : {"udpm://239.255.76.67:7667?ttl=0", "udpm://239.255.76.67:7667?ttl=1", "udpm://239.255.76.67",
                          "memq://", "file:///tmp/a.lcm", "file:///tmp/a.lcm?mode=r&speed=2"})
    EXPECT_EQ(lcm_url_warning(url), "") << url;
}

TEST(LcmUrl, AFileInWriteModeIsReported) {
  for (const char* url : {"file:///tmp/a.lcm?mode=w", "file:///tmp/a.lcm?speed=1&mode=a"})
    EXPECT_THAT(lcm_url_warning(url), HasSubstr("LCM writes messages into this file and sends none")) << url;
}

TEST(LcmUrl, TheEnvironmentCountsWhereNoneIsConfigured) {
  ::setenv("LCM_DEFAULT_URL", "udpm://239.255.76.67:7667?ttl=7", 1);
  EXPECT_THAT(lcm_url_warning(""), StartsWith("LCM_DEFAULT_URL is udpm://239.255.76.67:7667?ttl=7: with ttl 7"));
  EXPECT_EQ(lcm_url_warning("udpm://239.255.76.67:7667?ttl=1"), "");
  ::unsetenv("LCM_DEFAULT_URL");
  EXPECT_EQ(lcm_url_warning(""), "");
}

TEST(LcmUrl, IsReportedWhenLcmStarts) {
  ::testing::internal::CaptureStderr();
  try {
    open_lcm("file:///nonexistent/a.lcm?mode=w");
  } catch (const std::runtime_error&) {
  }
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), StartsWith("warning: LCM provider is file://"));
}

}  // namespace
}  // namespace bevel::nodes
