#pragma once
// The usual answer of a service: whether it was done, and what or why not.

#include <string>

#include "doppel/core/status.h"

namespace doppel {

template <class Response>
Response answer(const Status& status, std::string good) {
  Response response;
  response.success = status.ok();
  if constexpr (requires { response.status_message; }) {
    response.status_message = status.ok() ? std::move(good) : status.why();
  } else {
    response.message = status.ok() ? std::move(good) : status.why();
  }
  return response;
}

}  // namespace doppel
