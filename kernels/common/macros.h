// SPDX-License-Identifier: BSD-3-Clause
// The formulas of this folder compile for the host and, under nvcc, for the device.
#pragma once

#ifdef __CUDACC__
#define RETINT_HD __host__ __device__ inline
#else
#define RETINT_HD inline
#endif
