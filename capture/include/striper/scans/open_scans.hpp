// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include <striper/core/event.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/stream/scan_source.hpp>

namespace striper {

/// Opens scans by their address:
///
///     FILE.csv, csv:FILE      a table of scans, also one made elsewhere
///     FILE.jsonl, jsonl:FILE  scans as lines of JSON
///     FILE.mcap, mcap:FILE?head=H
///                             the scans of a recording, of all heads or of one, in the frames of
///                             the models attached to it; where it holds frames alone they are
///                             scanned with the attached model, and with `model` they are anyhow
///     SOURCE                  any source of frames (`open_source`), scanned on the way
///
/// @param model what the ranges are computed with; may be null for files, whose scans then do not
///        say how their frames lie in the head.
/// @param options how a source of frames is scanned; what it does not ask for is as the model says.
///        The pattern is the source's.
/// @param events hears of the source and the scanner.
/// @throws Error{kBadValue} where the model is of another sensor than the source's,
///         Error{kUnsupported} where it is to set an exposure that cannot be set,
///         Error as `open_source` and Scanner do, as `read_csv_scans` does; Error{kUsage} for a
///         source of frames without a model.
std::unique_ptr<ScanSource> open_scans(std::string_view uri,
                                       const std::shared_ptr<const StriperModel>& model,
                                       std::optional<ScannerOptions> options = std::nullopt,
                                       const EventPort& events = {});

}  // namespace striper
