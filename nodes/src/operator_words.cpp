// SPDX-License-Identifier: MIT
#include <bevel/nodes/operator_words.hpp>

#include <string_view>

namespace bevel::nodes {
namespace {

// A word that took longer was not said for what is now.
constexpr io::SenderLimits kLimits{.longest_age_us = 500'000, .fastest_hz = 100, .silence_us = 500'000};
constexpr std::int64_t kRefusalShown_ns = 5'000'000'000;

}  // namespace

OperatorWords::OperatorWords(LcmPort& port, const StatusReporter& status, Receiver receiver,
                             std::function<void(Word, const steering_target_t&)> obey)
    : port_(port), status_(status), receiver_(receiver), obey_(std::move(obey)) {
  // Stop and hold pass every watch, so they have a subscription of their own.
  port_.subscribe<steering_target_t>(io::channel::kSteeringTarget, [this](const steering_target_t& m) {
    const auto word = static_cast<Word>(m.request);
    if (word == Word::stop || word == Word::hold) obey_(word, m);
  });
  port_.subscribe<steering_target_t>(io::channel::kSteeringTarget, kLimits,
                                     [this](const steering_target_t& m) { hear(m); });
  port_.on_refused = [this](const char* channel, io::Standing standing) {
    if (std::string_view(channel) != io::channel::kSteeringTarget) return;
    if (standing == io::Standing::old) refuse("an operator's word came too late and was refused");
    if (standing == io::Standing::ahead) refuse("an operator's word from the future was refused");
  };
}

void OperatorWords::hear(const steering_target_t& m) {
  const auto word = static_cast<Word>(m.request);
  if (word == Word::stop || word == Word::hold) return;
  if (m.session[static_cast<std::size_t>(receiver_)] != status_.session())
    return refuse("an operator's word of another session was refused");
  refusal_ = "";
  obey_(word, m);
}

void OperatorWords::refuse(const char* why) {
  refusal_ = why;
  refused_ns_ = port_.now().ns;
}

std::string OperatorWords::refusal() const { return port_.now().ns - refused_ns_ < kRefusalShown_ns ? refusal_ : ""; }

}  // namespace bevel::nodes
