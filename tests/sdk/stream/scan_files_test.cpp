// SPDX-License-Identifier: Apache-2.0
// Proves that scans come back from their files bit for bit and as the same text, tables made
// elsewhere are read, and what is no such file is refused with its place. Does not prove the CSV's
// form itself: csv_sink_test does.
#include <cstring>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/scan_files.hpp>
#include <striper/wire/mcap_reader.hpp>

#include "support/error_of.hpp"
#include "support/made_scans.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// What must be the same when it is written again: all of a text, the scans of a recording.
std::string content_of(const std::filesystem::path& path) {
  if (path.extension() != ".mcap") return text_of(path);
  std::string content;
  wire::McapReader reader(path);
  for (wire::McapMessage message; reader.next(message);) {
    if (!reader.channels().at(message.channel).topic.ends_with("/polar_scan")) continue;
    content.append(message.data.begin(), message.data.end());
  }
  EXPECT_EQ(reader.end(), wire::McapEnd::kWhole);
  return content;
}

void put(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::vector<PolarScan> read_all(ScanSource& source) {
  std::vector<PolarScan> scans;
  PolarScan scan;
  while (source.next(scan, std::chrono::milliseconds(0)) == NextStatus::kFrame) {
    scans.push_back(scan);
  }
  return scans;
}

template <typename Scans>
void write_all(const std::string& uri, const HeadInfo& head, const Scans& scans) {
  const auto sink = open_sink(uri);
  sink->open(head);
  for (const PolarScan& scan : scans) sink->write(scan);
  sink->finish();
}

// NaN is NaN, and every other number the same with its sign.
template <typename Number>
bool is_same(Number a, Number b) {
  return (std::isnan(a) && std::isnan(b)) || (a == b && std::signbit(a) == std::signbit(b));
}

void expect_same(const Return& a, const Return& b) {
  EXPECT_EQ(a.status, b.status);
  for (double Return::*const member :
       {&Return::u_px, &Return::v_px, &Return::bearing_rad, &Return::range_m, &Return::range_near_m,
        &Return::range_far_m, &Return::sigma_m, &Return::sigma_cal_m, &Return::x_m, &Return::y_m}) {
    EXPECT_TRUE(is_same(a.*member, b.*member)) << a.*member << " is not " << b.*member;
  }
  for (float Return::*const member :
       {&Return::intensity_dn, &Return::width_px, &Return::row_sigma_px, &Return::confidence}) {
    EXPECT_TRUE(is_same(a.*member, b.*member)) << a.*member << " is not " << b.*member;
  }
}

void expect_same(const PolarScan& a, const PolarScan& b) {
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.time.seconds(), b.time.seconds());
  EXPECT_EQ(a.laser, b.laser);
  EXPECT_EQ(a.axis, b.axis);
  EXPECT_EQ(a.is_stripe_seen, b.is_stripe_seen);
  EXPECT_EQ(a.head(), b.head());
  ASSERT_NE(b.frame, nullptr);
  EXPECT_EQ(a.frame->frame_id, b.frame->frame_id);
  ASSERT_EQ(a.returns.size(), b.returns.size());
  for (std::size_t i = 0; i < a.returns.size(); ++i) expect_same(a.returns[i], b.returns[i]);
}

std::vector<PolarScan> some_scans() {
  testing::reseed();
  std::vector<PolarScan> scans;
  for (std::uint64_t n = 0; n < 20; ++n) {
    scans.push_back(testing::made_scan(n));
    scans.back().axis = StripeAxis::kColumns;
  }
  return scans;
}

class ScanFiles : public ::testing::TestWithParam<std::string> {
 protected:
  std::string path(const char* name) const { return (scratch_ / name).string() + "." + GetParam(); }
  std::unique_ptr<ScanSource> read(const std::string& path) const {
    if (GetParam() == "csv") return read_csv_scans(path);
    return GetParam() == "jsonl" ? read_jsonl_scans(path) : read_mcap_scans(path);
  }

  testing::ScratchDirectory scratch_;
};

TEST_P(ScanFiles, GiveTheSameScansAndTheSameText) {
  const std::string keys = GetParam() == "csv" ? "?missing=yes" : "";
  const std::vector<PolarScan> scans = some_scans();
  write_all(path("first") + keys, {}, scans);
  const auto source = read(path("first"));
  const std::vector<PolarScan> back = read_all(*source);
  ASSERT_EQ(back.size(), scans.size());
  for (std::size_t i = 0; i < scans.size(); ++i) expect_same(scans[i], back[i]);
  EXPECT_TRUE(source->info().source.has_clock);

  write_all(path("second") + keys, source->info(), back);
  EXPECT_TRUE(content_of(path("first")) == content_of(path("second")));
}

TEST_P(ScanFiles, TimesOfAYearComeBackAsTheyStand) {
  std::vector<PolarScan> scans(1000, testing::made_scan(0, 1));
  for (std::size_t i = 0; i < scans.size(); ++i) {
    scans[i].sequence = i;
    scans[i].time.monotonic_ns = static_cast<std::int64_t>(i * i) * 31'557'600'123;
  }
  write_all(path("first"), {}, scans);
  write_all(path("second"), {}, read_all(*read(path("first"))));
  EXPECT_TRUE(content_of(path("first")) == content_of(path("second")));
}

TEST_P(ScanFiles, WhatIsSomethingElseIsNotOverwritten) {
  put(path("model"), "striper_model: 1\n");
  const Error error = testing::error_of([&] { open_sink(path("model")); });
  EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  EXPECT_EQ(text_of(path("model")), "striper_model: 1\n");
}

TEST_P(ScanFiles, ScansGiveWayToScansOnceAHeadOpens) {
  write_all(path("scans"), {}, some_scans());
  const std::string before = text_of(path("scans"));
  const auto sink = open_sink(path("scans"));
  EXPECT_EQ(text_of(path("scans")), before);
  sink->open({});
  EXPECT_LT(text_of(path("scans")).size(), before.size());
}

TEST_P(ScanFiles, MissingFileIsNotFound) {
  EXPECT_EQ(testing::error_of([&] { read(path("none")); }).kind(), ErrorKind::kNotFound);
}

INSTANTIATE_TEST_SUITE_P(Formats, ScanFiles, ::testing::Values("csv", "jsonl", "mcap"),
                         [](const auto& format) { return format.param; });

TEST(ScanFilesInTurn, CsvComesBackThroughARecordingAndLinesOfJson) {
  const testing::ScratchDirectory scratch;
  const auto path = [&](const char* name) { return (scratch / name).string(); };
  write_all(path("a.csv") + "?missing=yes", {}, some_scans());
  const auto from_csv = read_csv_scans(path("a.csv"));
  write_all(path("b.mcap"), from_csv->info(), read_all(*from_csv));
  const auto from_mcap = read_mcap_scans(path("b.mcap"));
  write_all(path("c.jsonl"), from_mcap->info(), read_all(*from_mcap));
  const auto from_jsonl = read_jsonl_scans(path("c.jsonl"));
  write_all(path("d.csv") + "?missing=yes", from_jsonl->info(), read_all(*from_jsonl));
  EXPECT_TRUE(text_of(path("a.csv")) == text_of(path("d.csv")));
}

TEST(JsonlScans, KeepsFieldsAxesHeadsAndLasers) {
  const testing::ScratchDirectory scratch;
  PolarScan scan = testing::made_scan(3);
  scan.frame = make_scan_frame("le\"ft\\\n", 2, nullptr);
  scan.laser = 2;
  scan.axis = StripeAxis::kRows;
  scan.field = Field::kBottom;
  scan.is_stripe_seen = false;
  write_all((scratch / "a.jsonl").string(), {}, std::vector{scan});
  const auto source = read_jsonl_scans(scratch / "a.jsonl");
  EXPECT_EQ(source->info().head, "le\"ft\\\n");
  const auto back = read_all(*source);
  ASSERT_EQ(back.size(), 1U);
  expect_same(scan, back[0]);
  EXPECT_EQ(back[0].field, Field::kBottom);
}

TEST(JsonlScans, EventsStandBetweenScansAndAreReadOver) {
  const testing::ScratchDirectory scratch;
  const auto sink = open_sink((scratch / "a.jsonl").string());
  Event event("source_lost", "no \"answer\"", "the cable?");
  event.time_s = 12.5;
  event.head = "left";
  sink->event(event);
  sink->open({});
  sink->open({});  // A model that was read anew.
  sink->write(testing::made_scan(1));
  sink->event(event);
  sink->finish();
  const std::string text = text_of(scratch / "a.jsonl");
  const std::string line =
      "{\"event\":\"source_lost\",\"severity\":\"warning\",\"head\":\"left\",\"time_s\":12.5,"
      "\"message\":\"no \\\"answer\\\"\",\"advice\":\"the cable?\"}\n";
  EXPECT_TRUE(text.starts_with(line) && text.ends_with(line)) << text;
  EXPECT_EQ(read_all(*read_jsonl_scans(scratch / "a.jsonl")).size(), 1U);
}

TEST(JsonlScans, WhatIsWrongIsNamedWithItsPlace) {
  const testing::ScratchDirectory scratch;
  const auto problem = [&](const std::string& text) {
    put(scratch / "a.jsonl", text);
    const Error error =
        testing::error_of([&] { read_all(*read_jsonl_scans(scratch / "a.jsonl")); });
    EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
    return std::string(error.what());
  };
  EXPECT_THAT(problem("{\"head\":\n"), HasSubstr("a.jsonl:1: is no JSON"));
  EXPECT_THAT(problem("{\"sequence\":1,\"time_s\":0}\n"), HasSubstr("expected sequence, time_s"));
  EXPECT_THAT(problem("{\"sequence\":1,\"time_s\":0,\"status\":[\"fine\"]}\n"),
              HasSubstr("status is 'fine'"));
  for (const std::string text : {"1764200000000", "-1e300", "null"})  // Milliseconds, nonsense.
    EXPECT_THAT(problem("{\"sequence\":1,\"time_s\":" + text + ",\"status\":[\"ok\"]}\n"),
                HasSubstr("expected seconds, 4.6e+09 at most (not milliseconds)"));
  EXPECT_THAT(problem("{\"sequence\":1,\"time_s\":0,\"status\":[\"ok\"],\"u_px\":[1,2]}\n"),
              HasSubstr("u_px is '2 elements' - expected 1"));
  EXPECT_THAT(problem("{\"sequence\":1,\"time_s\":0,\"status\":[\"ok\"],\"bearing_rad\":[27.5]}\n"),
              HasSubstr("a.jsonl:1: bearing_rad is 27.5, more than a whole turn"));
}

TEST(JsonlScans, LastLineThatWasCutOffIsLeftOut) {
  const testing::ScratchDirectory scratch;
  const std::string whole = "{\"sequence\":1,\"time_s\":0,\"status\":[\"ok\"],\"u_px\":[1]}";
  for (std::size_t length = 1; length <= whole.size(); ++length) {
    put(scratch / "a.jsonl", whole + "\n" + whole.substr(0, length));
    const std::size_t scans = length == whole.size() ? 2 : 1;
    EXPECT_EQ(read_all(*read_jsonl_scans(scratch / "a.jsonl")).size(), scans) << length;
  }
}

TEST(SinkUri, BarePathIsAFileByItsExtension) {
  EXPECT_EQ(SinkUri::parse("a.jsonl").scheme(), "jsonl");
  EXPECT_EQ(SinkUri::parse("dir.d/scans").scheme(), "csv");
  EXPECT_EQ(SinkUri::parse("-").scheme(), "csv");
  EXPECT_EQ(SinkUri::parse("/dev/full").scheme(), "csv");
  EXPECT_EQ(SinkUri::parse("csv:a.txt").path(), "a.txt");
  EXPECT_EQ(SinkUri::parse("csv:a.csv?missing=yes").path(), "a.csv");
}

TEST(SinkUri, UnknownKindsAndKeysAreRefusedNamingTheKnown) {
  EXPECT_THAT(testing::error_of([] { open_sink("a.docx"); }).what(), HasSubstr(".csv, .jsonl"));
  EXPECT_THAT(testing::error_of([] { open_sink("ftp:a.csv"); }).what(), HasSubstr("csv, jsonl"));
  EXPECT_THAT(testing::error_of([] { open_sink("csv:a.csv?mising=yes"); }).what(),
              HasSubstr("unknown key 'mising'"));
  EXPECT_EQ(testing::error_of([] { open_sink(""); }).kind(), ErrorKind::kUsage);
}

}  // namespace
}  // namespace striper
