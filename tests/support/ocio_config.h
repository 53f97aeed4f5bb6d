// SPDX-License-Identifier: BSD-3-Clause
// An OpenColorIO config. The reference is light in ACEScg's primaries. "film log" has a camera's
// primaries and logarithm; "graded" mixes channels between two curves.
#pragma once

namespace retint {

inline constexpr const char* kOcioConfig = R"(ocio_profile_version: 2
roles: {default: light, scene_linear: light}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  sRGB: [!<View> {name: plain, colorspace: sRGB}]
colorspaces:
  - !<ColorSpace> {name: light}
  - !<ColorSpace>
    name: sRGB
    from_scene_reference: !<GroupTransform>
      children:
        - !<MatrixTransform> {matrix: [1.70505, -0.62179, -0.08326, 0, -0.13026, 1.1408, -0.01054, 0, -0.024, -0.12897, 1.15297, 0, 0, 0, 0, 1]}
        - !<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055, direction: inverse}
  - !<ColorSpace>
    name: film log
    to_scene_reference: &film !<GroupTransform>
      children:
        - !<LogAffineTransform> {base: 10, log_side_slope: 0.24719, log_side_offset: 0.385537, lin_side_slope: 5.555556, lin_side_offset: 0.052272, direction: inverse}
        - !<MatrixTransform> {matrix: [0.85, 0.12, 0.03, 0, 0.05, 0.98, -0.03, 0, 0.01, 0.04, 0.95, 0, 0, 0, 0, 1]}
  - !<ColorSpace>
    name: graded
    to_scene_reference: !<GroupTransform>
      children:
        - *film
        - !<ExponentTransform> {value: 1.4}
        - !<MatrixTransform> {matrix: [0.6, 0.3, 0.1, 0, 0.2, 0.7, 0.1, 0, 0.1, 0.2, 0.7, 0, 0, 0, 0, 1]}
)";

}  // namespace retint
