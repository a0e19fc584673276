// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/sinks/csv_sink.hpp>

namespace striper {
namespace {

constexpr std::string_view kHeader =
    "frame,time_s,laser,u_px,v_px,bearing_rad,range_m,range_near_m,range_far_m,sigma_m,sigma_cal_m,"
    "x_m,y_m,"
    "intensity,width_px,row_sigma_px,confidence,status\n";

constexpr mode_t kNewFileMode = 0644;

// The shortest text that reads back to the same bits; nothing at all for NaN.
template <typename Number>
void append(std::string& out, Number value) {
  if (!std::isnan(value)) fmt::format_to(std::back_inserter(out), "{}", value);
  out += ',';
}

void append_return(std::string& out, const PolarScan& scan, const Return& r) {
  fmt::format_to(std::back_inserter(out), "{},{},{},", scan.sequence, scan.time.seconds(),
                 scan.laser);
  for (const double value : {r.u_px, r.v_px, r.bearing_rad, r.range_m, r.range_near_m,
                             r.range_far_m, r.sigma_m, r.sigma_cal_m, r.x_m, r.y_m}) {
    append(out, value);
  }
  for (const float value : {r.intensity_dn, r.width_px, r.row_sigma_px, r.confidence})
    append(out, value);
  out += to_string(r.status);
  out += '\n';
}

bool wanted(const CsvOptions& options, ReturnStatus status) {
  switch (verdict(status)) {
    case Verdict::kGood:
      return true;
    case Verdict::kDoubtful:
      return options.doubtful;
    case Verdict::kMissing:
      return options.missing;
  }
  return false;
}

[[noreturn]] void fail(const std::string& path, const char* action) {
  const int error = errno;
  throw Error(ErrorKind::kIo,
              fmt::format("cannot {} '{}': {}", action, path == "-" ? "standard output" : path,
                          std::strerror(error)),
              error);
}

}  // namespace

void require_replaceable_by_scans(const std::string& path) {
  std::error_code ignored;
  if (path == "-" || !std::filesystem::is_regular_file(path, ignored)) return;
  std::ifstream file(path, std::ios::binary);
  std::string begin(kHeader.size(), '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  if (kHeader.starts_with(begin))
    return;  // Scans, or as much of their header as a disk could hold.
  throw Error(ErrorKind::kUsage,
              fmt::format("'{}' is there and holds no scans: it is not overwritten; remove it, or "
                          "name another file",
                          path));
}

CsvSink::CsvSink(const std::string& path, const CsvOptions& options)
    : path_(path), options_(options) {
  require_replaceable_by_scans(path);
  file_ = path == "-"
              ? STDOUT_FILENO
              : ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kNewFileMode);
  if (file_ < 0) fail(path_, "write");
  buffer_ = kHeader;
  try {
    write_bytes();
  } catch (...) {
    close_quietly();
    throw;
  }
}

CsvSink::~CsvSink() { close_quietly(); }

void CsvSink::close_quietly() noexcept {
  if (file_ > STDERR_FILENO) ::close(file_);
  file_ = -1;
}

void CsvSink::write(const PolarScan& scan) {
  buffer_.clear();
  std::uint64_t lines = 0;
  for (const Return& r : scan.returns) {
    if (!wanted(options_, r.status)) continue;
    append_return(buffer_, scan, r);
    ++lines;
  }
  write_bytes();
  lines_ += lines;
}

void CsvSink::write_bytes() {
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t count = ::write(file_, buffer_.data() + done, buffer_.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int error = errno;
      cut_back_to_whole_lines(done);
      errno = error;
      fail(path_, "write");
    }
    done += static_cast<std::size_t>(count);
  }
}

// What did not fit ends in half a line: takes that off again. Counted from where the file stands,
// since the standard output may have been redirected to the end of a file; a pipe cannot be cut,
// its reader has had what there was.
void CsvSink::cut_back_to_whole_lines(std::size_t done) {
  const std::size_t last_end = done == 0 ? std::string::npos : buffer_.rfind('\n', done - 1);
  const std::size_t whole = last_end == std::string::npos ? 0 : last_end + 1;
  const off_t end = ::lseek(file_, 0, SEEK_CUR);
  const auto excess = static_cast<off_t>(done - whole);
  if (excess > 0 && end >= excess) {
    [[maybe_unused]] const int ignored = ::ftruncate(file_, end - excess);
  }
}

void CsvSink::close() {
  if (file_ <= STDERR_FILENO) return;
  const int file = file_;
  file_ = -1;
  if (::close(file) != 0) fail(path_, "finish");
}

}  // namespace striper
