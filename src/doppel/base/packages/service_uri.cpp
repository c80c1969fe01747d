#include "doppel/base/packages/service_uri.h"

namespace doppel {
namespace {

constexpr std::string_view kPackage = "package://", kFile = "file://";

// The path in such a URI; empty: the URI is none of a package or a file, or its path has a colon.
std::string_view path_of(std::string_view uri) {
  std::string_view path;
  for (const std::string_view scheme : {kPackage, kFile}) {
    if (uri.starts_with(scheme)) path = uri.substr(scheme.size());
  }
  // An absolute path names a file; a package has a name.
  const bool absolute = path.starts_with('/');
  const bool clear = path.find(':') == std::string_view::npos && absolute == uri.starts_with(kFile);
  return clear ? path : std::string_view();
}

}  // namespace

std::string with_service_uris(std::string_view xml, std::string_view service) {
  constexpr std::string_view kAttribute = "filename";
  std::string out;
  std::size_t copied = 0;
  for (std::size_t found = xml.find(kAttribute); found != std::string_view::npos;
       found = xml.find(kAttribute, found + kAttribute.size())) {
    const std::size_t equals = xml.find_first_not_of(" \t\r\n", found + kAttribute.size());
    if (equals == std::string_view::npos || xml[equals] != '=') continue;
    const std::size_t quote = xml.find_first_not_of(" \t\r\n", equals + 1);
    if (quote == std::string_view::npos || (xml[quote] != '"' && xml[quote] != '\'')) continue;
    const std::size_t end = xml.find(xml[quote], quote + 1);
    if (end == std::string_view::npos) break;
    const std::string_view path = path_of(xml.substr(quote + 1, end - quote - 1));
    if (path.empty()) continue;
    out += xml.substr(copied, quote + 1 - copied);
    out.append("service://").append(service).append(":").append(path);
    copied = end;
  }
  out += xml.substr(copied);
  return out;
}

std::string uri_of_service_path(std::string_view path) {
  if (path.find("://") != std::string_view::npos) return std::string(path);
  return std::string(path.starts_with('/') ? kFile : kPackage).append(path);
}

}  // namespace doppel
