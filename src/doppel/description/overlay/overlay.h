#pragma once
// The corrections of one description, in NAME.overlay.yaml next to it, applied on load by every command, so
// that they remain effective after a new export, and also where another file includes the description. An
// operation whose target has changed since is reported and not applied; one whose result is already in the
// description is not applied again.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/overlay/operation.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"

namespace doppel {

struct Overlay {
  std::filesystem::path file;
  std::vector<Operation> operations;
};

// The path of a description's overlay: arm.xacro, arm.urdf.xacro, arm.urdf -> arm.overlay.yaml in
// the same folder.
DOPPEL_API std::filesystem::path overlay_path(const std::filesystem::path& description);

// Throws InputError with file:line:column; unknown keys and operations get the nearest valid one.
DOPPEL_API Overlay read_overlay(const std::filesystem::path& file);
DOPPEL_API Overlay parse_overlay(const std::string& yaml, const std::string& name);
DOPPEL_API std::string to_yaml(const Overlay& overlay);

enum class OperationState {
  applied,
  already_there,   // the description contains the result (it was baked, or the CAD was corrected)
  changed,         // the target differs from the fingerprint: not applied
  no_target,       // the joint or link does not exist (any more)
  no_fingerprint,  // there is no fingerprint: not applied
  superseded,  // of an included file: where the robot stands, or its name, which the including file decides
};
DOPPEL_API std::string_view to_string(OperationState state);  // "applied", "already there"...

struct OperationOutcome {
  OperationState state = OperationState::applied;
  std::string message;  // the reason why it was not applied; empty if it was
};

// Applies the operations to the expanded tree, in the overlay's order. Outcomes other than `applied` are
// also warnings (rules "overlay.changed", "overlay.no_target", "overlay.no_fingerprint", and
// "overlay.impossible" if the tree does not permit it) or notes ("overlay.already_there") in `diagnostics`,
// not exceptions, so that an obsolete correction does not prevent loading. An angle that looks like degrees
// without a unit is a warning ("overlay.degrees").
DOPPEL_API std::vector<OperationOutcome> apply_overlay(const Overlay& overlay,
                                                       ExpandedDescription& description,
                                                       const PackageResolver& resolver,
                                                       Diagnostics& diagnostics);

// An overlay as it was applied to a description.
struct AppliedOverlay {
  std::filesystem::path description;  // the file that it stands beside
  std::string prefix;                 // of the names of an included file, from a macro's parameter: "left_"
  bool included = false;
  Overlay overlay;  // its operations with the names of this description
  std::vector<OperationOutcome> outcomes;
};

// Applies the overlays beside the files that the description includes, so that an included file is the same
// as with its corrections baked into it. An inner file precedes the file that includes it. Names are
// searched among the elements that come from the file; if none has its plain name, under the prefixes that
// a macro's parameter, an argument or a property gave them, once for each. What cannot be applied is one
// line ("overlay.no_target" or the note "overlay.included"). The overlays are added to `files`. Throws
// InputError: an overlay cannot be read.
DOPPEL_API std::vector<AppliedOverlay> apply_included_overlays(ExpandedDescription& description,
                                                               const PackageResolver& resolver,
                                                               Diagnostics& diagnostics);
// These, then the description's own overlay, which is the last element if there is one.
DOPPEL_API std::vector<AppliedOverlay> apply_overlays(ExpandedDescription& description,
                                                      const PackageResolver& resolver,
                                                      Diagnostics& diagnostics);

// The places of the overlays of these sources; they may not exist.
DOPPEL_API std::vector<std::filesystem::path> overlay_paths(const std::vector<std::filesystem::path>& files);

// Sets the fingerprint (`was`) of a new operation from the present tree. Throws InputError with the nearest
// name if the target does not exist.
DOPPEL_API void take_fingerprint(Operation& operation, const ExpandedDescription& description);

// Appends operations to the description's overlay (a new file if there is none); the rest of the file is
// unchanged. A setting of the same values of the same target is replaced, and an existing operation is
// not added again. Throws InputError for one without a fingerprint, and if the file cannot be written.
// Returns the file.
DOPPEL_API std::filesystem::path add_to_overlay(const std::filesystem::path& description,
                                                const std::vector<Operation>& operations);

// Removes the i-th operation from the file; the rest of the file is unchanged. Throws InputError.
DOPPEL_API void remove_from_overlay(const Overlay& overlay, std::size_t i);
// Writes the fingerprint (`was`) of the i-th operation into the file; the rest is
// unchanged. Throws InputError.
DOPPEL_API void stamp_overlay(const Overlay& overlay, std::size_t i, const Operation& stamped);

// -- loading with the overlay, as in every command
// expand_description and apply_overlays. Throws InputError.
DOPPEL_API ExpandedDescription expand_corrected(const std::filesystem::path& file,
                                                const XacroArguments& arguments, PackageResolver& resolver,
                                                Diagnostics& diagnostics);
// load_description with the overlay applied.
DOPPEL_API LoadedDescription load_corrected(const std::filesystem::path& file,
                                            const XacroArguments& arguments, PackageResolver& resolver,
                                            Diagnostics& diagnostics);

}  // namespace doppel
