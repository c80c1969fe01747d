#include "doppel/scenario/sdf/detail/material_script.h"

#include <algorithm>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/text.h"

namespace doppel::sdf {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxScriptBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxScripts = 100;    // in one folder
constexpr int kMaxMaterialInheritance = 8;  // levels

// Words, braces, ends of lines; comments are skipped.
class ScriptTokens {
 public:
  explicit ScriptTokens(std::string_view text) : text_(text) {}

  // "\n" at the end of a line; "" at the end of the text.
  std::string_view next() {
    skip_blanks();
    if (at_ >= text_.size()) return {};
    const std::size_t from = at_;
    const char c = text_[at_++];
    if (c == '\n' || c == '{' || c == '}') return text_.substr(from, 1);
    if (c == '"') {
      const std::size_t end = std::min(text_.find_first_of("\"\n", at_), text_.size());
      const std::string_view word = text_.substr(at_, end - at_);
      at_ = end < text_.size() && text_[end] == '"' ? end + 1 : end;
      return word.empty() ? std::string_view("\"") : word;
    }
    at_ = std::min(text_.find_first_of(" \t\r\n{}", at_), text_.size());
    return text_.substr(from, at_ - from);
  }

 private:
  void skip_blanks() {
    while (at_ < text_.size()) {
      const std::string_view rest = text_.substr(at_);
      if (rest.starts_with("//")) {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (rest.starts_with("/*")) {
        const std::size_t end = text_.find("*/", at_ + 2);
        at_ = end == std::string_view::npos ? text_.size() : end + 2;
      } else if (rest.front() == ' ' || rest.front() == '\t' || rest.front() == '\r') {
        ++at_;
      } else {
        return;
      }
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

using ScriptLine = std::vector<std::string_view>;

// The words up to the end of the line or the next brace, which is in `stop` ("" at the end of the text).
ScriptLine next_line(ScriptTokens& tokens, std::string_view& stop) {
  ScriptLine out;
  while (true) {
    const std::string_view token = tokens.next();
    if (token.empty() || token == "\n" || token == "{" || token == "}") {
      stop = token;
      return out;
    }
    out.push_back(token);
  }
}

std::optional<Eigen::Vector4d> colour_of(const ScriptLine& line) {
  Eigen::Vector4d out(0, 0, 0, 1);
  if (line.size() < 4) return std::nullopt;
  for (std::size_t i = 1; i < std::min<std::size_t>(line.size(), 5); ++i) {
    const std::optional<double> value = parse_number(line[i]);
    if (!value) return i == 4 ? std::optional(out) : std::nullopt;
    out[static_cast<Eigen::Index>(i) - 1] = std::clamp(*value, 0.0, 1.0);
  }
  return out;
}

void take_line(const ScriptLine& line, ScriptedMaterial& out) {
  if (line.empty()) return;
  if (line.front() == "diffuse" && !out.diffuse) out.diffuse = colour_of(line);
  if (line.front() == "texture" && line.size() > 1 && out.texture.empty()) out.texture = line[1];
}

}  // namespace

std::map<std::string, ScriptedMaterial> parse_material_script(std::string_view text) {
  std::map<std::string, ScriptedMaterial> out;
  ScriptTokens tokens(text);
  ScriptedMaterial* current = nullptr;
  ScriptLine head;  // the last line outside of braces
  int depth = 0;
  std::string_view stop = "\n";
  while (!stop.empty()) {
    const ScriptLine line = next_line(tokens, stop);
    if (current != nullptr) take_line(line, *current);
    if (depth == 0 && !line.empty()) head = line;
    if (stop == "{" && depth++ == 0 && head.size() > 1 && head.front() == "material") {
      current = &out[std::string(head[1])];
      *current = {};
      if (head.size() > 3 && head[2] == ":") current->base = head[3];
    } else if (stop == "}" && depth > 0 && --depth == 0) {
      current = nullptr;
      head.clear();
    }
  }
  return out;
}

const MaterialScripts::Materials& MaterialScripts::read(const fs::path& place) {
  const auto [known, fresh] = read_.try_emplace(place);
  if (!fresh) return known->second;
  std::error_code none;
  std::vector<fs::path> files;
  if (fs::is_directory(place, none)) {
    for (fs::directory_iterator it(place, none), end; !none && it != end; it.increment(none)) {
      if (lowered(it->path().extension().string()) == ".material") files.push_back(it->path());
    }
    std::sort(files.begin(), files.end());
    if (files.size() > kMaxScripts) files.resize(kMaxScripts);
  } else {
    files.push_back(place);
  }
  for (const fs::path& file : files) {
    try {
      known->second.merge(parse_material_script(read_file(file.string(), kMaxScriptBytes)));
    } catch (const InputError&) {
      continue;  // its materials are reported where they are used
    }
  }
  return known->second;
}

std::optional<MaterialScripts::Found> MaterialScripts::find(const std::string& name,
                                                            const std::vector<std::string>& uris,
                                                            const fs::path& folder) {
  if (search_ == nullptr || name.empty()) return std::nullopt;
  std::vector<fs::path> places;
  for (const std::string& uri : uris) {
    if (const FoundFile& found = search_->find(uri, folder); !found.path.empty())
      places.push_back(found.path);
  }
  const auto named = [&](const std::string& wanted) -> const ScriptedMaterial* {
    for (const fs::path& place : places) {
      const Materials& materials = read(place);
      if (const auto at = materials.find(wanted); at != materials.end()) return &at->second;
    }
    return nullptr;
  };
  const ScriptedMaterial* material = named(name);
  if (material == nullptr) return std::nullopt;
  Found out;
  for (int level = 0; material != nullptr && level < kMaxMaterialInheritance; ++level) {
    if (!out.diffuse) out.diffuse = material->diffuse;
    if (out.texture.empty()) out.texture = material->texture;
    material = material->base.empty() ? nullptr : named(material->base);
  }
  const fs::path file = fs::path(out.texture).lexically_normal();  // "sub/../../x.png" leaves the folder, too
  if (out.texture.empty() || file.is_absolute() || *file.begin() == "..") return out;
  std::error_code none;
  for (const fs::path& place : places) {
    const fs::path around = fs::is_directory(place, none) ? place : place.parent_path();
    for (const fs::path& in : {around, around.parent_path() / "textures"}) {
      if (!fs::is_regular_file(in / file, none)) continue;
      out.texture_path = (in / file).lexically_normal().string();
      return out;
    }
  }
  return out;
}

}  // namespace doppel::sdf
