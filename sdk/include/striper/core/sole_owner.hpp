// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

namespace striper {

/// Whether nobody else would see it if these pixels were overwritten. Read atomically, as it is
/// written: another thread may be letting go of its copy, and must have read all it wanted.
inline bool is_sole_owner(const cv::Mat& image) {
  return image.u != nullptr && CV_XADD(&image.u->refcount, 0) == 1;
}

}  // namespace striper
