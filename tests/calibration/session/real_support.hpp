// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <striper/session/calibrate.hpp>

#include "support/shared_data.hpp"

namespace striper::testing {

/// The images of a directory whose names begin with `prefix`, sorted.
inline std::vector<SessionImage> images_in(const std::filesystem::path& directory,
                                           const std::string& prefix = "") {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    const std::string extension = entry.path().extension().string();
    const bool image = extension == ".jpg" || extension == ".png" || extension == ".tif";
    if (image && entry.path().filename().string().starts_with(prefix))
      paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return {paths.begin(), paths.end()};
}

/// Corners as another program found them: lines of image,col,row,x,y.
inline Observations corners_from_csv(const std::filesystem::path& file, const Board& board,
                                     int width, int height) {
  Observations observations;
  observations.board = board;
  observations.image_width = width;
  observations.image_height = height;
  std::map<std::string, CornerView> views;
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::string name;
    int column = 0;
    int row = 0;
    double x = 0.0;
    double y = 0.0;
    if (!(words >> name >> column >> row >> x >> y)) continue;
    CornerView& view = views[name];
    view.name = name;
    view.point.push_back(row * board.columns + column);
    view.pixel.emplace_back(x, y);
  }
  for (auto& [name, view] : views) observations.views.push_back(std::move(view));
  return observations;
}

}  // namespace striper::testing
