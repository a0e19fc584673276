// SPDX-License-Identifier: Apache-2.0
// Whatever bytes a picture file has, decode_picture gives a picture or says what is wrong; it never
// throws. Seeds: a small picture of every format.
#include <cstdint>
#include <cstdlib>

#include "images/decode.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  striper::Picture picture;
  const striper::detail::Fault fault = striper::detail::decode_picture({data, size}, picture);
  if (fault.empty() && picture.image.empty()) std::abort();
  return 0;
}
