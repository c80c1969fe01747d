#pragma once
// From XML to scopes: worlds, models and what they include.

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/scenario/sdf/detail/sdf_scope.h"
#include "doppel/scenario/sdf/detail/sdf_shapes.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel::sdf {

class Document {
 public:
  Document(Elements& elements, Files& files, PackageResolver& resolver)
      : elements_(elements), files_(files), resolver_(resolver), frames_(elements) {}

  // Throws InputError: not XML, or neither a world nor a model. `out` gets settings, lights and plugins.
  void read(std::string text, const std::string& name, const std::filesystem::path& folder, SdfWorld& out);
  void read(XmlNode root, const std::string& name, const std::filesystem::path& folder, SdfWorld& out);

  [[nodiscard]] Scope& world() { return world_; }
  [[nodiscard]] Frames& frames() { return frames_; }
  [[nodiscard]] const XmlNode* state() const { return state_; }
  [[nodiscard]] const std::vector<std::filesystem::path>& read_files() const { return read_files_; }

 private:
  struct Override;
  const Source* load(const std::filesystem::path& file);
  const Source* keep(XmlNode root, const std::filesystem::path& folder);
  void read_source(const Source& source, const std::string& name, SdfWorld& out);
  const Source* parse(std::string text, const std::string& name, const std::filesystem::path& folder);
  void read_world(const XmlNode& node, const Source& source, SdfWorld& out);
  void read_physics(const XmlNode& node, SdfWorld& out);
  void read_earth(const XmlNode& node, EarthFrame& out);
  void read_items(const XmlNode& node, const Source& source, Scope& scope, SdfWorld* world, int depth);
  void read_model(const XmlNode& node, const Source& source, Scope& into, const Override* over, int depth);
  void read_urdf(const std::filesystem::path& file, Scope& into, const Override& over);
  void read_include(const XmlNode& node, const Source& source, Scope& into, SdfWorld* world, int depth);
  void read_include(const XmlNode& node, const Source& source, Scope& into, SdfWorld* world, int depth,
                    const std::string& name, const WrittenPose& pose);
  void read_population(const XmlNode& node, const Source& source, Scope& into, SdfWorld* world, int depth);
  void stand_in(const XmlNode& node, const Override& over, const std::string& uri, const FoundFile& found,
                Scope& into);
  void merge(Item model, Scope& into);
  void add_joint(const XmlNode& node, const Source& source, Scope& scope);
  bool built_in(const std::string& uri, const Override& over, Scope& into, SdfWorld* world, int depth);
  const XmlNode& made(std::string text);

  Elements& elements_;
  Files& files_;
  PackageResolver& resolver_;
  Frames frames_;
  Scope world_;
  const XmlNode* state_ = nullptr;
  std::map<std::filesystem::path, std::unique_ptr<Source>> sources_;
  std::vector<std::unique_ptr<Source>> texts_;
  std::vector<std::filesystem::path> read_files_, including_;
  std::map<std::string, int> stand_ins_;  // by URI
  std::size_t elements_read_ = 0;         // of all models
};

}  // namespace doppel::sdf
