// Wavefront OBJ: vertices, faces, and the diffuse colour of the first material used. Source: Wavefront
// Advanced Visualizer Manual, appendix B1, 1995.
#include <fmt/format.h>

#include "doppel/description/meshes/detail/mesh.h"
#include "doppel/description/meshes/detail/text_scanner.h"

namespace doppel::mesh {
namespace {

class ObjReader {
 public:
  ObjReader(std::string_view bytes, const std::string& name, const Sidecar& sidecar)
      : text_(bytes), name_(name), sidecar_(sidecar) {}

  TriangleSoup read() {
    while (!text_.at_end()) {
      const std::string_view word = text_.word_in_line();
      if (word == "v") {
        vertex();
      } else if (word == "f") {
        face();
      } else if (word == "mtllib") {
        libraries_.emplace_back(text_.rest_of_line());
        continue;
      } else if (word == "usemtl" && material_.empty()) {
        material_ = text_.rest_of_line();
        continue;
      }
      text_.skip_line();
    }
    find_colour();
    return std::move(soup_);
  }

 private:
  void vertex() {
    Eigen::Vector3f p;
    for (int k = 0; k < 3; ++k) {
      const auto value = TextScanner::to_number(text_.word_in_line());
      if (!value) refuse(name_, text_.line(), "'v' must be followed by three numbers");
      p[k] = static_cast<float>(*value);
    }
    if (!p.allFinite()) refuse(name_, text_.line(), "a vertex is too large");
    soup_.points.push_back(p);
  }

  void face() {
    corners_.clear();
    while (true) {
      const std::string_view word = text_.word_in_line();
      if (word == "\\") {  // the line continues
        text_.skip_line();
        continue;
      }
      if (word.empty() || word.front() == '#') break;
      corners_.push_back(index(word.substr(0, word.find('/'))));
    }
    if (corners_.size() < 3) {
      refuse(name_, text_.line(),
             fmt::format("a face has {} vertices; at least three are needed", corners_.size()));
    }
    add_polygon(soup_, corners_);
  }

  // From 1 on, or from the end where negative.
  std::uint32_t index(std::string_view word) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    const auto count = static_cast<std::int64_t>(soup_.points.size());
    const std::int64_t at = value < 0 ? count + value : value - 1;
    if (word.empty() || error != std::errc{} || end != word.data() + word.size() || at < 0 || at >= count) {
      refuse(name_, text_.line(),
             fmt::format("the face refers to vertex '{}', but there are {} before it", word.substr(0, 40),
                         count));
    }
    return static_cast<std::uint32_t>(at);
  }

  void find_colour() {
    if (material_.empty() || !sidecar_) return;
    for (const std::string& library : libraries_) {
      const std::string bytes = sidecar_(library);
      TextScanner text(bytes);
      bool wanted = false;
      while (!text.at_end()) {
        const std::string_view word = text.word_in_line();
        if (word == "newmtl") {
          wanted = text.rest_of_line() == material_;
          continue;
        }
        if (wanted && word == "Kd") {
          Eigen::Vector4f rgba(0, 0, 0, 1);
          bool good = true;
          for (int k = 0; k < 3; ++k) {
            const auto value = TextScanner::to_number(text.word_in_line());
            good = good && value;
            rgba[k] = static_cast<float>(value.value_or(0.0));
          }
          if (good) soup_.rgba = rgba;
          return;
        }
        text.skip_line();
      }
    }
  }

  TextScanner text_;
  const std::string& name_;
  const Sidecar& sidecar_;
  TriangleSoup soup_;
  std::vector<std::uint32_t> corners_;
  std::vector<std::string> libraries_;
  std::string material_;
};

}  // namespace

TriangleSoup read_obj(std::string_view bytes, const std::string& name, const Sidecar& sidecar) {
  return ObjReader(bytes, name, sidecar).read();
}

}  // namespace doppel::mesh
