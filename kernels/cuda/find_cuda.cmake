# SPDX-License-Identifier: BSD-3-Clause
# Decides whether the CUDA backend is built, and for which generations of GPUs.
#   RETINT_CUDA               AUTO: where a CUDA compiler works. ON: an error where none does. OFF: never.
#   CMAKE_CUDA_COMPILER       the compiler; else nvcc from CUDACXX, the PATH, or /usr/local/cuda/bin
#   CMAKE_CUDA_ARCHITECTURES  the generations, e.g. 86-real;90-real or all-major; else those of the GPUs that are
#                             present, else a short list that runs on every GPU from compute capability 7.5 on
# retint_find_cuda() sets RETINT_HAVE_CUDA and, where it is true, has enabled the language.

# Compute capabilities of the GPUs in this machine, times ten and without repetition, e.g. 86;90. Empty without one.
function(retint_present_gpus result)
  # A driver in trouble may not answer at all.
  execute_process(COMMAND nvidia-smi --query-gpu=compute_cap --format=csv,noheader
    TIMEOUT 30 RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_QUIET)
  set(gpus)
  if(code EQUAL 0)
    string(REGEX MATCHALL "[0-9]+\\.[0-9]+" gpus "${text}")
    string(REPLACE "." "" gpus "${gpus}")
    list(REMOVE_DUPLICATES gpus)
  endif()
  set(${result} "${gpus}" PARENT_SCOPE)
endfunction()

# The generations to compile for, of those that `nvcc` knows, in CMake's words. A GPU newer than the compiler gets
# code that its driver translates when the program first runs.
function(retint_cuda_generations nvcc result)
  execute_process(COMMAND ${nvcc} --list-gpu-code OUTPUT_VARIABLE text ERROR_QUIET)
  string(REGEX MATCHALL "sm_[0-9]+" known "${text}")
  list(TRANSFORM known REPLACE "sm_" "")
  list(SORT known COMPARE NATURAL)
  # The kernels are written for 7.5 and newer.
  list(FILTER known INCLUDE REGEX "^(7[5-9]|[89][0-9]|[0-9][0-9][0-9])$")
  set(generations)
  retint_present_gpus(gpus)
  foreach(gpu ${gpus})
    set(best)
    foreach(generation ${known})
      if(generation LESS_EQUAL gpu)
        set(best ${generation})
      endif()
    endforeach()
    math(EXPR gpu_major "${gpu} / 10")
    math(EXPR best_major "0${best} / 10")
    if(best_major EQUAL gpu_major)
      list(APPEND generations ${best}-real)
    elseif(best)
      list(APPEND generations ${best}-virtual)
    endif()
  endforeach()
  if(NOT generations AND known)
    # Every real generation would cost minutes of compiling. Code for 8.0 runs on all of 8.x; the
    # driver translates the oldest one's for whatever else there is.
    list(GET known 0 oldest)
    list(APPEND generations ${oldest}-virtual)
    foreach(generation 80 90)
      if(generation IN_LIST known)
        list(APPEND generations ${generation}-real)
      endif()
    endforeach()
  endif()
  list(REMOVE_DUPLICATES generations)
  set(${result} "${generations}" PARENT_SCOPE)
endfunction()

# Sets CMAKE_CUDA_COMPILER to a compiler that works, or `why` to what is missing.
macro(retint_find_cuda_compiler)
  if(NOT CMAKE_CUDA_COMPILER)
    unset(CMAKE_CUDA_COMPILER CACHE)  # what an earlier run did not find may be there by now
    if(NOT DEFINED ENV{CUDACXX})
      find_program(RETINT_NVCC nvcc HINTS ENV CUDA_PATH ENV CUDA_HOME PATHS /usr/local/cuda PATH_SUFFIXES bin)
      mark_as_advanced(RETINT_NVCC)
      if(EXISTS "${RETINT_NVCC}")
        set(ENV{CUDACXX} ${RETINT_NVCC})
      endif()
    endif()
    if(NOT DEFINED ENV{CUDACXX})
      set(why "no CUDA compiler (nvcc) was found; CUDACXX=/path/to/nvcc names one")
    else()
      include(CheckLanguage)
      check_language(CUDA)
      if(NOT CMAKE_CUDA_COMPILER)
        set(why "the CUDA compiler $ENV{CUDACXX} does not work here; CMakeFiles/CMakeError.log says why")
      endif()
    endif()
  endif()
endmacro()

# A macro, since languages are enabled in the directory that calls.
macro(retint_find_cuda)
  set(RETINT_HAVE_CUDA FALSE)
  set(why)
  if(NOT RETINT_CUDA STREQUAL "AUTO" AND NOT RETINT_CUDA)
    set(why "RETINT_CUDA is ${RETINT_CUDA}")
  elseif(RETINT_CUDA STREQUAL "AUTO" AND RETINT_SANITIZE)
    set(why "this build is sanitized")
  else()
    retint_find_cuda_compiler()
  endif()
  if(NOT why)
    if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
      retint_cuda_generations(${CMAKE_CUDA_COMPILER} CMAKE_CUDA_ARCHITECTURES)
    endif()
    enable_language(CUDA)
    # CMake 3.25 does not know which standards CUDA 13 has.
    set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
    if(CMAKE_CUDA_COMPILER_VERSION VERSION_LESS 12)
      set(why "CUDA ${CMAKE_CUDA_COMPILER_VERSION} is older than 12.0, the first with C++20")
    endif()
  endif()
  if(NOT why)
    find_package(CUDAToolkit REQUIRED)
    set(RETINT_HAVE_CUDA TRUE)
    message(STATUS "CUDA backend: built with CUDA ${CMAKE_CUDA_COMPILER_VERSION} for ${CMAKE_CUDA_ARCHITECTURES}")
  elseif(RETINT_CUDA STREQUAL "AUTO" OR NOT RETINT_CUDA)
    message(STATUS "CUDA backend: not built (${why})")
  else()
    message(FATAL_ERROR "The CUDA backend was asked for (RETINT_CUDA=${RETINT_CUDA}): ${why}")
  endif()
endmacro()
