// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <striper/core/append_file.hpp>
#include <striper/core/csv_file.hpp>

namespace striper {

/// What one beam saw on one way across its window.
struct BeamSweep {
  double time_s = 0.0;  ///< Of the first sample, which is at the window's left end.
  std::int64_t odometer_counts = 0;
  std::string beam;             ///< Its name.
  std::vector<double> samples;  ///< As the converter gave them; may end early.
};

/// Reads `sweeps.csv`: `time_s,odometer_counts,beam,s0,s1,...`; a line may end early, or its cells
/// be empty from some sample on. As `CsvReader` in all that is not said here.
class SweepReader {
 public:
  /// @throws Error{kBadFile} naming what is missing of the header; Error{kNotFound, kIo}.
  explicit SweepReader(CsvInput input);

  /// @return false at the end; a last line that was cut off is left out.
  /// @throws Error{kBadFile} naming file, line, column and value.
  bool next(BeamSweep& sweep);

  std::size_t cut_line() const noexcept { return cut_line_; }  ///< 0 where none was cut off.

 private:
  CsvInput input_;
  std::size_t columns_ = 0;
  std::size_t cut_line_ = 0;
};

/// @throws Error as `SweepReader` does.
SweepReader open_sweeps_csv(const std::filesystem::path& path);

/// Writes one, header first.
class SweepWriter {
 public:
  /// @param samples of the longest sweep. @throws Error as `AppendFile` does.
  SweepWriter(std::string path, std::size_t samples);

  void add(const BeamSweep& sweep);
  void close();

 private:
  AppendFile output_;
  std::size_t waiting_ = 0;
};

}  // namespace striper
