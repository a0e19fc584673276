// SPDX-License-Identifier: Apache-2.0
// Whatever bytes an image file has, decode_image gives an image or says what is wrong; it never
// throws. Seeds: a small image of every format.
#include <cstdint>
#include <cstdlib>

#include "images/decode.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  striper::DecodedImage decoded;
  const striper::detail::Fault fault = striper::detail::decode_image({data, size}, decoded);
  if (fault.empty() && decoded.image.empty()) std::abort();
  return 0;
}
