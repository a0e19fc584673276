// SPDX-License-Identifier: Apache-2.0
// Proves how a source's address is taken apart and that whatever is wrong in it is refused by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

using ::testing::HasSubstr;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    return error.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return {};
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
              HasSubstr("unknown kind 'video'; there are images, sim, v4l2, gige, u3v"));
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

}  // namespace
}  // namespace striper
