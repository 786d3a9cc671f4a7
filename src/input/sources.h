/// Where the text of a deck and the files it names come from.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "model/diagnostic.h"

namespace mbcosim {

/// Reads files by name. Names are relative to the deck's folder, with `/`; readers resolve includes
/// before they ask.
class FileSource {
 public:
  virtual ~FileSource() = default;
  /// Text of a file; ErrorKind::io with a message without host paths ("cannot open \"a.inc\"", "not
  /// a regular file", "outside the allowed folder").
  virtual Result<std::string> read(const std::string& name) const = 0;
};

/// Files below one folder. Refuses absolute names, `..` that leaves the folder and links that lead
/// out, unless `unrestricted` (the command line on the user's own files, where pipes are read, too:
/// `mbcosim run /dev/stdin -o out`).
class FolderSource : public FileSource {
 public:
  explicit FolderSource(std::string folder, bool unrestricted = false);
  Result<std::string> read(const std::string& name) const override;

 private:
  std::string folder_;
  bool unrestricted_;
};

/// Files held in memory (an uploaded bundle).
class BundleSource : public FileSource {
 public:
  explicit BundleSource(std::map<std::string, std::string> files) : files_(std::move(files)) {}
  Result<std::string> read(const std::string& name) const override;

 private:
  std::map<std::string, std::string> files_;
};

/// The first of `inputs` that is one of the files `outputs`, by whatever name; empty: none. Files
/// that do not exist are none.
std::string file_in_both(const std::vector<std::string>& inputs,
                         const std::vector<std::string>& outputs);

}  // namespace mbcosim
