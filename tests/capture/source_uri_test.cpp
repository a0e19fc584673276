// SPDX-License-Identifier: Apache-2.0
// Proves how a source's address is taken apart, that what was put together comes apart again
// whatever characters it has, and that whatever is wrong in it is refused by name.
#include <functional>
#include <map>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>

#include "support/error_of.hpp"
#include "support/random.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::uniform;

std::size_t below(std::size_t count) {
  return static_cast<std::size_t>(uniform(0.0, static_cast<double>(count)));
}

std::string random_text(const std::string& characters, std::size_t longest) {
  std::string text;
  for (std::size_t size = below(longest + 1); size > 0; --size) {
    text += characters[below(characters.size())];
  }
  return text;
}

std::string message_of(const std::function<void()>& action) {
  const Error error = testing::error_of(action);
  EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  return error.what();
}

TEST(SourceUri, QueryBeginsAtTheLastQuestionMarkThatIsFollowedByAKey) {
  SourceUri uri = SourceUri::parse("images:shots/img_????.png?fps=30&laser=0,dark");
  EXPECT_EQ(uri.scheme(), "images");
  EXPECT_EQ(uri.path(), "shots/img_????.png");
  EXPECT_EQ(uri.take_number("fps", 0, 1000), 30.0);
  EXPECT_EQ(uri.take("laser"), "0,dark");
  EXPECT_NO_THROW(uri.refuse_unused("fps, laser"));
}

TEST(SourceUri, GlobWithoutAQueryKeepsItsQuestionMarks) {
  EXPECT_EQ(SourceUri::parse("images:a?b?.png").path(), "a?b?.png");
  EXPECT_EQ(SourceUri::parse("?").path(), "?");
}

TEST(SourceUri, BarePathGetsItsSchemeFromWhatItIs) {
  EXPECT_EQ(SourceUri::parse("scene.yaml").scheme(), "sim");
  EXPECT_EQ(SourceUri::parse("/dev/video2").scheme(), "v4l2");
  EXPECT_EQ(SourceUri::parse("shots").scheme(), "images");
  EXPECT_EQ(SourceUri::parse("shots/*.png?fps=5").path(), "shots/*.png");
}

TEST(SourceUri, UnknownSchemeIsRefusedNamingThoseThatExist) {
  EXPECT_THAT(message_of([] { SourceUri::parse("video:/dev/video0"); }),
              HasSubstr("unknown kind 'video'; there are images, mcap, sim, v4l2, gige, u3v"));
}

TEST(SourceUri, MisspeltKeyIsNamedWithThoseThatExist) {
  const SourceUri uri = SourceUri::parse("images:x?fsp=3");
  EXPECT_THAT(message_of([&] { uri.refuse_unused("fps, laser, fields"); }),
              HasSubstr("unknown key 'fsp'; images: knows fps, laser, fields"));
}

TEST(SourceUri, ValueOutsideItsBoundsIsQuoted) {
  SourceUri uri = SourceUri::parse("images:x?fps=0&n=1.5&b=maybe");
  EXPECT_THAT(message_of([&] { uri.take_number("fps", 0.1, 1000); }),
              HasSubstr("fps=0 - expected a number from 0.1 to 1000"));
  EXPECT_THAT(message_of([&] { uri.take_integer("n", 0, 9); }),
              HasSubstr("n=1.5 - expected a whole number from 0 to 9"));
  EXPECT_THAT(message_of([&] { uri.take_bool("b"); }), HasSubstr("b=maybe - expected yes or no"));
}

TEST(SourceUri, KeyGivenTwiceOrWithoutValueIsRefused) {
  EXPECT_THAT(message_of([] { SourceUri::parse("images:x?fps=1&fps=2"); }),
              HasSubstr("fps is given twice"));
  EXPECT_THAT(message_of([] { SourceUri::parse("images:x?fps=1&laser"); }),
              HasSubstr("'laser' is not key=value"));
  EXPECT_THAT(message_of([] { SourceUri::parse(""); }), HasSubstr("empty"));
}

TEST(SourceUri, WhatWasPutTogetherComesApart) {
  // Everything that a path, a glob or a value may have; '=' is left out of the path, where a '?'
  // before it would begin a query by the rule itself.
  const std::string path_characters = "ab/*?[]{}:&#%+ .,-_~\\\t\xc3\xa9";
  const std::string value_characters = "09az,.:/*[]#%+ -_=\xc3\xa9";
  const std::string key_characters = "abXY01_.-";
  for (int round = 0; round < 5000; ++round) {
    constexpr const char* kSchemes[] = {"images", "mcap", "sim", "v4l2", "gige", "u3v"};
    const std::string scheme = kSchemes[below(6)];
    const std::string path = random_text(path_characters, 20);
    std::map<std::string, std::string> parameters;
    for (std::size_t i = below(4); i > 0; --i) {
      parameters[fmt::format("k{}", random_text(key_characters, 6))] =
          random_text(value_characters, 10);
    }
    std::string text = fmt::format("{}:{}", scheme, path);
    char separator = '?';
    for (const auto& [key, value] : parameters) {
      text += fmt::format("{}{}={}", separator, key, value);
      separator = '&';
    }
    SourceUri uri = SourceUri::parse(text);
    ASSERT_EQ(uri.text(), text);
    ASSERT_EQ(uri.scheme(), scheme) << text;
    ASSERT_EQ(uri.path(), path) << text;
    ASSERT_EQ(uri.take_rest(), parameters) << text;
    ASSERT_EQ(SourceUri::parse(uri.text()).path(), path) << text;
    ASSERT_NO_THROW(uri.refuse_unused("all"));
  }
}

}  // namespace
}  // namespace striper
