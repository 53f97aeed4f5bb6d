# SPDX-License-Identifier: BSD-3-Clause
# RETINT_QUICK, for apps/demo.sh: the sources of a library are compiled in a few large pieces (CMake's unity build), and
# most of them with -O1. For example, the 27 sources of src/recolor become four pieces and one alone. All pieces with -O1
# share one precompiled header.

option(RETINT_PIECES "Compile several sources at once" ON)

# If two sources of a library define the same name for themselves, such as kStage, list the name here. In a piece, the
# name of each source then ends in an identifier of that source. A name that a header uses cannot be listed.
set(retint_base_names kDigits)
set(retint_kernels_names kPiece)
set(retint_colmap_io_names CheckSize Decode Encode ReadObservations)
set(retint_splat_io_names CheckLength ColumnOffsets FileDegree HeaderText Indexed Json PackRotation PackSh
  RequireColumns kBlockBytes kBlockRows kMark kMostDepth)
set(retint_synthetic_names Displace kPi)
set(retint_depth_names kMargin)
set(retint_selection_names Candidate Each Features4 Mixture UsualDepth kGrain kKnownFraction kLeastVisible kLeastWeight
  kLogLimit kReach kSmoothness kStage kStrong kValley)
set(retint_recolor_names Part Samples kMostBytes kMostSamples kReach kRounds)
set(retint_opening_names Thinned)
set(retint_editing_names kOverNoise)
set(retint_reporting_names Row)
set(retint_pipeline_names Mebibytes kMiB)
set(retint_cli_names Arguments CheckArguments Joined OpenPainted Typed)

# Sources that are compiled alone: for several instruction sets, with a using directive, or with a name of a header.
set(retint_kernels_alone cpu/edit_colors.cc cpu/image_loss_simd.cc cpu/reached_tiles.cc cpu/sh_kernels.cc
  cpu/stereo_arbitrate.cc cpu/stereo_match_simd.cc cpu/stereo_refine.cc cpu/tile_kernels_simd.cc)
set(retint_colmap_io_alone photo.cc)
set(retint_splat_io_alone row_vectors.cc)
set(retint_synthetic_alone synthetic_scene.cc)
set(retint_depth_alone sparse_errors.cc)
set(retint_recolor_alone edit_json.cc)
set(retint_selection_alone mask_tools/guided_matte.cc views_between.cc)
set(retint_editing_alone picture_changes.cc main_colors.cc)
set(retint_reporting_alone report_html.cc)

# What nearly every piece includes, read once for all libraries with -O1.
file(WRITE ${PROJECT_BINARY_DIR}/quick_headers.cc "")
add_library(retint_quick_headers STATIC ${PROJECT_BINARY_DIR}/quick_headers.cc)
target_compile_features(retint_quick_headers PRIVATE cxx_std_20)
target_compile_options(retint_quick_headers PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:-O1;-w>")
target_link_libraries(retint_quick_headers PRIVATE Eigen3::Eigen fmt::fmt)
target_precompile_headers(retint_quick_headers PRIVATE <algorithm> <array> <atomic> <charconv> <cmath> <cstdint>
  <cstring> <filesystem> <functional> <map> <memory> <mutex> <numeric> <optional> <set> <span> <string> <string_view>
  <thread> <utility> <vector> <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <nlohmann/json.hpp>)

# retint_compile_quickly(NAME): in the folder of the target.
function(retint_compile_quickly name)
  set(level -O1)
  # The demo spends most of its time in the ray tracer that makes the sample, and in the kernels.
  if(name MATCHES "^retint_(kernels|synthetic)$")
    set(level -O3)
  endif()
  # No warnings: in a piece, a local name may hide that of another source.
  target_compile_options(${name} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:${level};-w>")
  if(RETINT_PIECES AND level STREQUAL "-O1")
    target_link_libraries(${name} PRIVATE Eigen3::Eigen fmt::fmt)  # of the header, with the same definitions
    target_precompile_headers(${name} REUSE_FROM retint_quick_headers)
  endif()
  get_target_property(sources ${name} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cc$")
  list(LENGTH sources count)
  if(count LESS 3 OR NOT RETINT_PIECES)
    return()
  endif()
  set(before "#define RETINT_PASTE(name, source) name##_##source\n")
  string(APPEND before "#define RETINT_OWN(name, source) RETINT_PASTE(name, source)\n")
  set(after "")
  foreach(own ${${name}_names})
    string(APPEND before "#define ${own} RETINT_OWN(${own}, RETINT_SOURCE)\n")
    string(APPEND after "#undef ${own}\n")
  endforeach()
  set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8 UNITY_BUILD_UNIQUE_ID RETINT_SOURCE
    UNITY_BUILD_CODE_BEFORE_INCLUDE "${before}" UNITY_BUILD_CODE_AFTER_INCLUDE "${after}")
  set_source_files_properties(${${name}_alone} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()
