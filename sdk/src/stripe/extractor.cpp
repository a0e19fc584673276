// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stripe/extractor.hpp>

#include "stripe/paper_extractor.hpp"

namespace striper {

void ExtractOptions::validate() const {
  if (threshold_dn && !(*threshold_dn > 0.0 && std::isfinite(*threshold_dn))) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("threshold_dn is {}; expected a number of DN above 0", *threshold_dn));
  }
}

std::unique_ptr<StripeExtractor> make_extractor(const ExtractOptions& options) {
  options.validate();
  switch (options.method) {
    case ExtractMethod::kPaper:
      return std::make_unique<detail::PaperExtractor>(options);
    case ExtractMethod::kFast:
    case ExtractMethod::kRefined:
      break;
  }
  throw Error(ErrorKind::kUnsupported, "this build knows the extraction method 'paper' only");
}

}  // namespace striper
