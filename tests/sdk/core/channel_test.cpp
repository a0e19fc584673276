// SPDX-License-Identifier: Apache-2.0
// Proves that every channel has a word of its own, that the words are those of the model file and
// the command line, and that nothing else is one. What a channel does to an image is proved with
// the ambient stage.
#include <string>
#include <string_view>
#include <utility>

#include <gtest/gtest.h>

#include <striper/core/channel.hpp>

namespace striper {
namespace {

constexpr std::pair<Channel, std::string_view> kWords[] = {
    {Channel::kAuto, "auto"},
    {Channel::kGrey, "grey"},
    {Channel::kRed, "red"},
    {Channel::kGreen, "green"},
    {Channel::kBlue, "blue"},
    {Channel::kGreenMinusRed, "green-red"},
    {Channel::kRedMinusGreen, "red-green"},
};

TEST(Channel, WordsReadBack) {
  for (const auto& [channel, word] : kWords) {
    EXPECT_EQ(to_string(channel), word);
    EXPECT_EQ(channel_from_string(word), channel) << word;
  }
}

TEST(Channel, WhatIsNoWordOfOursIsNone) {
  for (const std::string_view word :
       {"", "gray", "Grey", " grey", "grey ", "green-", "green-blue", "red-green-blue", "0"}) {
    EXPECT_EQ(channel_from_string(word), std::nullopt) << "'" << word << "'";
  }
}

// A view of a longer text: only what is in the view counts.
TEST(Channel, PartOfATextIsReadAsThePart) {
  const std::string text = "green-red";
  EXPECT_EQ(channel_from_string(std::string_view(text).substr(0, 5)), Channel::kGreen);
  EXPECT_EQ(channel_from_string(std::string_view(text).substr(6)), Channel::kRed);
}

}  // namespace
}  // namespace striper
