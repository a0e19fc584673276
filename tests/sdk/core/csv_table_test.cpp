// SPDX-License-Identifier: Apache-2.0
// Proves that a table reads back what was written, to the last bit; that other people's tables are
// read as RFC 4180 has them; that each way to be damaged is refused with file, line, column, value
// and what was expected, or, where only the end was cut off, read up to there; and that rows cost
// no allocation. Does not prove that a disk keeps what it was given.
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <striper/core/csv_table.hpp>

#include "support/allocation_counter.hpp"
#include "support/error_of.hpp"
#include "support/random.hpp"
#include "support/scratch_directory.hpp"

namespace striper {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::ScratchDirectory;

enum class Fruit { kApple, kPear };
constexpr std::array<CsvWord<Fruit>, 2> kFruits{{{Fruit::kApple, "apple"}, {Fruit::kPear, "pear"}}};

struct Row {
  std::string name;
  std::int64_t count = 0;
  std::uint8_t small = 0;
  double length = 0.0;
  float weight = 0.0F;
  std::optional<std::int64_t> maybe;
  int bounded = 8;
  Fruit fruit = Fruit::kApple;
};

constexpr std::array kColumns{
    csv_column<Row>(
        "name", [](auto& r) -> auto& { return r.name; }, CsvNeed::kRequired),
    csv_column<Row>(
        "count", [](auto& r) -> auto& { return r.count; }),
    csv_column<Row>(
        "small", [](auto& r) -> auto& { return r.small; }),
    csv_column<Row>(
        "length", [](auto& r) -> auto& { return r.length; }),
    csv_column<Row>(
        "weight", [](auto& r) -> auto& { return r.weight; }),
    csv_column<Row>(
        "maybe", [](auto& r) -> auto& { return r.maybe; }),
    csv_column<Row>("bounded",
                    [](auto& r) {
                      return CsvBetween{r.bounded, 8, 16};
                    }),
    csv_column<Row>("fruit",
                    [](auto& r) {
                      return CsvWords{r.fruit, kFruits};
                    }),
};

CsvReader<Row> reader_of(const std::string& text) {
  return {CsvInput::of_text("t.csv", text), kColumns, "table of fruit"};
}

std::vector<Row> rows_of(const std::string& text, std::size_t* cut_line = nullptr) {
  CsvReader<Row> reader = reader_of(text);
  std::vector<Row> rows;
  for (Row row; reader.next(row); row = {}) rows.push_back(row);
  if (cut_line != nullptr) *cut_line = reader.cut_line();
  return rows;
}

std::vector<std::string> names_of(const std::string& text, std::size_t* cut_line = nullptr) {
  std::vector<std::string> names;
  for (const Row& row : rows_of(text, cut_line)) names.push_back(row.name);
  return names;
}

std::string message_of(const std::string& text) {
  const Error error = testing::error_of([&] { rows_of(text); });
  EXPECT_EQ(error.kind(), ErrorKind::kBadFile);
  return error.what();
}

bool same_bits(double a, double b) { return std::isnan(a) ? std::isnan(b) : a == b; }

Row random_row(int i) {
  using testing::uniform;
  Row row;
  row.name = i % 3 == 0 ? "plain" : i % 3 == 1 ? "a,b" : "say \"x\"";
  row.count = static_cast<std::int64_t>(uniform(-9e18, 9e18));
  row.small = static_cast<std::uint8_t>(uniform(0, 256));
  row.length = std::ldexp(uniform(-1, 1), static_cast<int>(uniform(-1070, 1020)));
  row.weight = static_cast<float>(std::ldexp(uniform(-1, 1), static_cast<int>(uniform(-140, 120))));
  if (i % 5 == 0) row.length = std::copysign(HUGE_VAL, uniform(-1, 1));
  if (i % 7 == 0) row.length = std::numeric_limits<double>::quiet_NaN();
  if (i % 2 == 0) row.maybe = row.count / 2;
  row.bounded = static_cast<int>(uniform(8, 17));
  row.fruit = i % 2 == 0 ? Fruit::kApple : Fruit::kPear;
  return row;
}

TEST(CsvTable, RowsReadBackToTheSameBits) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "t.csv";
  std::vector<Row> rows;
  CsvWriter<Row> writer(path, kColumns);
  for (int i = 0; i < 2000; ++i) writer.add(rows.emplace_back(random_row(i)));
  writer.close();

  CsvReader<Row> reader(CsvInput::open(path), kColumns, "table");
  for (const Row& row : rows) {
    Row again;
    ASSERT_TRUE(reader.next(again));
    EXPECT_EQ(again.name, row.name);
    EXPECT_EQ(again.count, row.count);
    EXPECT_EQ(again.small, row.small);
    EXPECT_TRUE(same_bits(again.length, row.length)) << row.length;
    EXPECT_TRUE(same_bits(again.weight, row.weight)) << row.weight;
    EXPECT_EQ(again.maybe, row.maybe);
    EXPECT_EQ(again.bounded, row.bounded);
    EXPECT_EQ(again.fruit, row.fruit);
  }
  Row none;
  EXPECT_FALSE(reader.next(none));
  EXPECT_EQ(reader.cut_line(), 0U);
}

TEST(CsvTable, NumbersAreTheShortestTextAndWhatDoesNotExistIsEmpty) {
  Row row;
  row.length = 0.1;
  row.weight = std::numeric_limits<float>::infinity();
  std::string text;
  CsvWriter<Row>::append(text, kColumns, row);
  row.length = std::numeric_limits<double>::quiet_NaN();
  row.name = "two\nlines";
  CsvWriter<Row>::append(text, kColumns, row);
  EXPECT_EQ(text, ",0,0,0.1,inf,,8,apple\ntwo lines,0,0,,inf,,8,apple\n");
}

TEST(CsvTable, OtherPeoplesTablesAreRead) {
  EXPECT_THAT(names_of("\xef\xbb\xbfname\r\na\r\n\r\nb\r\n"), ElementsAre("a", "b"));
  EXPECT_THAT(names_of("colour,name\nred,x\n\"green, blue\",\"y \"\"z\"\"\"\n"),
              ElementsAre("x", "y \"z\""));
  EXPECT_THAT(names_of("name,colour\n\"a\nb\",red\nc,red\n"), ElementsAre("a\nb", "c"));
  const std::vector<Row> rows = rows_of("count,name\n-5,x\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].count, -5);
  EXPECT_EQ(rows[0].bounded, 8);
}

TEST(CsvTable, EachDamageIsRefusedWithItsPlace) {
  EXPECT_THAT(message_of(""), HasSubstr("'t.csv' is empty: no header line"));
  EXPECT_THAT(message_of("count\n1\n"), HasSubstr("no column 'name': it is no table of fruit"));
  EXPECT_THAT(message_of("name,name\n"),
              HasSubstr("line 1: the header has the column 'name' twice"));
  EXPECT_THAT(message_of("name,count\na\n"), HasSubstr("line 2: 1 fields, but the header has 2"));
  EXPECT_THAT(message_of("name\na,b\n"), HasSubstr("line 2: 2 fields, but the header has 1"));
  EXPECT_THAT(message_of("name\na\"b\n"), HasSubstr("line 2: a quote within a field"));
  EXPECT_THAT(message_of("name\n\"a\"b\n"), HasSubstr("line 2: text behind a quoted field"));
  EXPECT_THAT(message_of("name\n\n\n\"a\nb\nc\n"), HasSubstr("line 4: a quote is never closed"));
  EXPECT_THAT(message_of(std::string("name\na\0b\n", 9)), HasSubstr("line 2: a null byte"));
  const std::string longest(CsvInput::kLongestLine + 10, 'x');
  EXPECT_THAT(message_of("name\n" + longest), HasSubstr("line 2: it does not end"));
  EXPECT_THAT(message_of("name\n\"" + longest), HasSubstr("line 2: a quote is never closed"));
}

TEST(CsvTable, EachValueThatCannotBeIsRefusedWithWhatWasExpected) {
  const std::vector<std::array<std::string, 3>> bad{
      {"count", "1.5", "a whole number"},
      {"count", "", "a whole number"},
      {"count", " 1", "a whole number"},
      {"count", "9223372036854775808", "a whole number"},
      {"small", "-1", "a whole number from 0"},
      {"small", "256", "a whole number from 0"},
      {"length", "nan", "a number, inf or nothing"},
      {"length", "INF", "a number, inf or nothing"},
      {"length", "1e400", "a number, inf or nothing"},
      {"length", "1,5", "a number, inf or nothing"},
      {"weight", "1e39", "a number, inf or nothing"},
      {"maybe", "x", "a whole number or nothing"},
      {"bounded", "17", "a whole number from 8 to 16"},
      {"fruit", "plum", "one of apple, pear"},
  };
  for (const auto& [column, value, expected] : bad) {
    EXPECT_THAT(message_of(fmt::format("name,{}\na,\"{}\"\n", column, value)),
                HasSubstr(fmt::format("'t.csv' line 2: column '{}' cannot be '{}' - expected {}",
                                      column, value, expected)));
  }
  EXPECT_THAT(message_of("name,count\na," + std::string(5000, '\x1b') + "\n"),
              HasSubstr("cannot be '" + std::string(60, '?') + "...'"));
}

TEST(CsvTable, WhereverItIsCutOffItsWholeRowsAreRead) {
  std::string text;
  CsvWriter<Row>::append_header(text, kColumns);
  const std::size_t header = text.size();
  std::vector<std::size_t> ends{header};
  for (int i = 0; i < 6; ++i) {
    CsvWriter<Row>::append(text, kColumns, random_row(i));
    ends.push_back(text.size());
  }
  for (std::size_t cut = header; cut <= text.size(); ++cut) {
    SCOPED_TRACE(cut);
    std::size_t cut_line = 0;
    const std::size_t count = rows_of(text.substr(0, cut), &cut_line).size();
    std::size_t whole = 0;
    // A word at the end is whole without its line end; half of it is no word.
    while (whole + 1 < ends.size() && ends[whole + 1] - 1 <= cut) ++whole;
    EXPECT_EQ(count, whole);
    EXPECT_EQ(cut_line, cut > ends[whole] ? whole + 2 : 0);
  }
}

TEST(CsvTable, NumberAtACutOffEndIsNotTaken) {
  std::size_t cut_line = 0;
  EXPECT_THAT(names_of("name,count\na,1\nb,12", &cut_line), ElementsAre("a"));
  EXPECT_EQ(cut_line, 3U);
  EXPECT_THAT(names_of("count,name\n1,a\n2,b", &cut_line), ElementsAre("a", "b"));
  EXPECT_EQ(cut_line, 0U);
}

TEST(CsvTable, RowsCostNoAllocation) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "t.csv";
  CsvWriter<Row> writer(path, kColumns);
  const auto write = [&](int count) {
    for (int i = 0; i < count; ++i) writer.add(random_row(i));
    writer.flush();
  };
  write(100);
  const testing::AllocationCounter writing;
  for (int i = 0; i < 50; ++i) write(100);
  EXPECT_EQ(writing.count(), 0U);
  writer.close();

  CsvReader<Row> reader(CsvInput::open(path), kColumns, "table");
  Row row;
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(reader.next(row));
  const testing::AllocationCounter reading;
  while (reader.next(row)) continue;
  EXPECT_EQ(reading.count(), 0U);
}

TEST(CsvTable, FilesThatCannotBeReadAreNamed) {
  const ScratchDirectory scratch;
  const Error missing = testing::error_of([&] { CsvInput::open(scratch / "none.csv"); });
  EXPECT_EQ(missing.kind(), ErrorKind::kNotFound);
  EXPECT_THAT(missing.what(), HasSubstr("none.csv': No such file or directory"));
  const Error folder = testing::error_of([&] { CsvInput::open(scratch.path()).next(); });
  EXPECT_EQ(folder.kind(), ErrorKind::kIo);
  EXPECT_THAT(folder.what(), HasSubstr("Is a directory"));
}

}  // namespace
}  // namespace striper
