// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <striper/design/striper_design.hpp>
#include <striper/simulator/scene.hpp>

namespace striper::program {

/// A design out of a file: of a scene (`striper_scene:`) all of it, of a model the geometry, and
/// its noise and its stripe's look where it has them.
/// @throws Error as `load_scene` and `load_model`; Error{kUsage} where a model has no laser.
StriperDesign load_design(const std::filesystem::path& path);

/// What the simulator's scene is made of, its first laser.
StriperDesign design_of(const Scene& scene);

}  // namespace striper::program
