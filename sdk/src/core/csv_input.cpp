// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstring>
#include <system_error>

#include <fmt/format.h>

#include <striper/core/csv_file.hpp>
#include <striper/core/error.hpp>

namespace striper {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 16;
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::size_t kNone = std::string_view::npos;

}  // namespace

CsvInput CsvInput::open(const std::filesystem::path& path) {
  CsvInput input;
  input.name_ = path.string();
  input.file_.reset(std::fopen(path.c_str(), "rbe"));
  if (!input.file_) {
    const int reason = errno;
    throw Error(reason == ENOENT ? ErrorKind::kNotFound : ErrorKind::kIo,
                fmt::format("'{}': {}", input.name_, std::generic_category().message(reason)));
  }
  std::setvbuf(input.file_.get(), nullptr, _IONBF, 0);  // The buffer is here.
  return input;
}

CsvInput CsvInput::of_text(std::string name, std::string text) {
  CsvInput input;
  input.name_ = std::move(name);
  input.buffer_.assign(text.begin(), text.end());
  input.end_ = input.buffer_.size();
  return input;
}

void CsvInput::refuse(const std::string& message) const {
  throw Error(ErrorKind::kBadFile, fmt::format("'{}' line {}: {}", name_, line_, message));
}

// Puts more bytes behind those that are there; false at the end of the file.
bool CsvInput::read_more() {
  if (!file_) return false;
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (buffer_.size() < end_ + kChunk) buffer_.resize(end_ + kChunk);
  const std::size_t count = std::fread(buffer_.data() + end_, 1, kChunk, file_.get());
  if (count == 0 && std::ferror(file_.get()) != 0) {
    throw Error(ErrorKind::kIo,
                fmt::format("'{}': {}", name_, std::generic_category().message(errno)));
  }
  end_ += count;
  return count > 0;
}

// How many bytes the next line has, without its end; a line end in quotes is none.
std::size_t CsvInput::find_line_end() {
  bool in_quotes = false;
  for (std::size_t at = 0; begin_ + at < end_ || read_more(); ++at) {
    if (at > kLongestLine) {
      refuse(fmt::format("{} - expected a line of at most {} bytes",
                         in_quotes ? "a quote is never closed" : "it does not end", kLongestLine));
    }
    const char c = buffer_[begin_ + at];
    if (c == '"') in_quotes = !in_quotes;
    if (c != '\n') continue;
    ++lines_read_;
    if (!in_quotes) return at;
  }
  return kNone;
}

bool CsvInput::next() {
  while (true) {
    line_ = lines_read_ + 1;
    const std::size_t length = find_line_end();
    is_ended_ = length != kNone;
    char* const begin = buffer_.data() + begin_;
    char* end = begin + (is_ended_ ? length : end_ - begin_);
    begin_ = is_ended_ ? begin_ + length + 1 : end_;
    if (end != begin && end[-1] == '\r') --end;
    if (line_ == 1 && std::string_view(begin, static_cast<std::size_t>(end - begin))
                          .starts_with(kByteOrderMark)) {
      split(begin + kByteOrderMark.size(), end);
      return true;
    }
    if (end != begin) {
      split(begin, end);
      return true;
    }
    if (!is_ended_) return false;
  }
}

// In place: a quoted cell only becomes shorter.
void CsvInput::split(char* begin, char* end) {
  cells_.clear();
  if (std::memchr(begin, '\0', static_cast<std::size_t>(end - begin)) != nullptr)
    refuse("a null byte - expected text");
  char* from = begin;
  while (true) {
    char* to = from;
    if (from != end && *from == '"') {
      to = split_quoted(from + 1, end);
    } else {
      while (to != end && *to != ',' && *to != '"') ++to;
      if (to != end && *to == '"') refuse("a quote within a field that does not begin with one");
      cells_.emplace_back(from, static_cast<std::size_t>(to - from));
    }
    if (to == end) return;
    from = to + 1;
  }
}

// @return behind the cell: its comma, or the line's end.
char* CsvInput::split_quoted(char* from, char* end) {
  char* out = from;
  char* in = from;
  while (in != end && (*in != '"' || (in + 1 != end && in[1] == '"'))) {
    if (*in == '"') ++in;
    *out++ = *in++;
  }
  // A line that was cut off in a quoted field; where a whole line end is in it, a quote is wrong.
  if (in == end && (is_ended_ || std::memchr(from, '\n', static_cast<std::size_t>(end - from))))
    refuse("a quote is never closed");
  cells_.emplace_back(from, static_cast<std::size_t>(out - from));
  if (in == end) {
    cells_.clear();  // Fewer than any table has: cut off.
    return end;
  }
  ++in;
  if (in != end && *in != ',') refuse("text behind a quoted field");
  return in;
}

}  // namespace striper
