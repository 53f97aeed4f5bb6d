# SPDX-License-Identifier: BSD-3-Clause
# kernels/cuda/find_cuda.cmake with small programs that play nvcc and nvidia-smi. cmake -DWORK=FOLDER -P this
cmake_minimum_required(VERSION 3.25)
include(${CMAKE_CURRENT_LIST_DIR}/../../kernels/cuda/find_cuda.cmake)

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/bin)
set(ENV{PATH} "${WORK}/bin:$ENV{PATH}")
unset(ENV{CUDACXX})

function(write_program name text)
  file(WRITE ${WORK}/bin/${name} "#!/bin/sh\n${text}\n")
  file(CHMOD ${WORK}/bin/${name} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
endfunction()

# expect_generations(CODES GPUS EXPECTED): what is compiled where nvcc knows CODES and nvidia-smi runs GPUS.
function(expect_generations codes gpus expected)
  write_program(nvcc "for code in ${codes}; do echo sm_$code; done")
  write_program(nvidia-smi "${gpus}")
  retint_cuda_generations(${WORK}/bin/nvcc generations)
  if(NOT generations STREQUAL expected)
    message(SEND_ERROR "nvcc of ${codes}, nvidia-smi \"${gpus}\": ${generations} instead of ${expected}")
  endif()
endfunction()

set(cuda_12 "50 60 70 75 80 86 87 89 90")
set(cuda_13 "75 80 86 87 88 89 90 100 110 103 120 121")
# The GPUs that are present, each generation once.
expect_generations("${cuda_13}" "echo 8.6" "86-real")
expect_generations("${cuda_13}" "echo 12.0; echo 8.9; echo 8.9" "120-real;89-real")
expect_generations("${cuda_13}" "echo 10.3" "103-real")
# Newer than the compiler: code of an older member of its family, or what the driver translates.
expect_generations("75 80 86" "echo 8.9" "86-real")
expect_generations("${cuda_12}" "echo 12.0" "90-virtual")
# Older than the kernels are written for, no GPU, a driver in trouble, words instead of numbers.
set(everywhere "75-virtual;80-real;90-real")
expect_generations("${cuda_12}" "echo 6.1" "${everywhere}")
expect_generations("${cuda_12}" "echo 6.1; echo 7.5" "75-real")
expect_generations("${cuda_12}" "exit 0" "${everywhere}")
expect_generations("${cuda_13}" "echo 9.0; exit 9" "${everywhere}")
expect_generations("${cuda_13}" "echo Field compute_cap is not valid" "${everywhere}")
expect_generations("75 80 86 87" "exit 9" "75-virtual;80-real")
expect_generations("90 100 120" "exit 9" "90-virtual;90-real")

# expect_configured(NAME FAILS TEXT ARGUMENT...): a project configured with the arguments.
function(expect_configured name fails text)
  execute_process(
    COMMAND ${CMAKE_COMMAND} -G Ninja -S ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/find_cuda -B ${WORK}/${name} ${ARGN}
    RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  string(REGEX REPLACE "[ \n]+" " " output "${output}")  # CMake wraps what it says
  if(fails AND code EQUAL 0 OR NOT fails AND NOT code EQUAL 0)
    message(SEND_ERROR "${name}: cmake ended with ${code}\n${output}")
  endif()
  if(NOT output MATCHES "${text}")
    message(SEND_ERROR "${name}: \"${text}\" is not in\n${output}")
  endif()
endfunction()

set(missing -DRETINT_NVCC=${WORK}/no/nvcc)
expect_configured(auto FALSE "not built \\(no CUDA compiler.*RETINT_HAVE_CUDA is FALSE" -DRETINT_CUDA=AUTO ${missing})
expect_configured(on TRUE "asked for \\(RETINT_CUDA=ON\\): no CUDA compiler" -DRETINT_CUDA=ON ${missing})
expect_configured(off FALSE "not built \\(RETINT_CUDA is OFF\\)" -DRETINT_CUDA=OFF)
expect_configured(sanitized FALSE "not built \\(this build is sanitized\\)" -DRETINT_CUDA=AUTO -DRETINT_SANITIZE=thread)
# A compiler that can't compile.
write_program(nvcc "echo broken >&2; exit 1")
set(broken -DRETINT_NVCC=${WORK}/bin/nvcc)
expect_configured(broken_auto FALSE "not built \\(the CUDA compiler .* does not work here" -DRETINT_CUDA=AUTO ${broken})
expect_configured(broken_on TRUE "asked for .* does not work here" -DRETINT_CUDA=ON ${broken})
