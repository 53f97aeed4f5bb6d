// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace retint {

// Base64 (RFC 4648) in pieces.
class Base64Encoder {
 public:
  std::string Add(std::string_view bytes);  // the bytes that are complete by now
  std::string Finish();                     // the rest, padded

 private:
  std::string rest_;
};
std::string EncodeBase64(std::string_view bytes);  // all at once
// Appends to `bytes`. False where it is not base64.
bool DecodeBase64(std::string_view text, std::string& bytes);

}  // namespace retint
