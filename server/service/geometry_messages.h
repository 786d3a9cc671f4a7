/// The geometry of a simulation as messages of bounded size.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "mbcosim/v1/geometry.pb.h"
#include "model/deck_file.h"
#include "service/attached_files.h"
#include "simulation/geometry_view.h"

namespace mbcosim::server {

/// Tells all that can be drawn of a simulation as it stands, message by message.
class GeometryMessages {
 public:
  using Handles = std::function<int(const std::string& variable)>;  ///< negative: no such variable
  /// `model` outlives this; `files`: of the deck, for its cards; `attached`: to it, or null. Throws
  /// Refusal when the request is wrong.
  GeometryMessages(const Model& model, State state, Handles handles, DeckFiles files,
                   std::shared_ptr<const AttachedFiles> attached,
                   const v1::DescribeGeometryRequest& request);

  /// Fills the next message; false: there is none.
  bool next(v1::DescribeGeometryReply* reply);

 private:
  enum class Part { header, nodes, elements, modal_points, cards, attachments, end };

  void fill_header(v1::GeometryHeader* out) const;
  void fill_nodes(v1::NodeGeometryList* out);
  void fill_elements(v1::ElementGeometryList* out);
  bool find_modes();
  void fill_modal_points(v1::ModalPoints* out);
  void begin_modal_points(const ElementGeometry::Modes& modes, v1::ModalPoints* out) const;
  void fill_cards(v1::DeckCardList* out);
  bool next_attachment(v1::FileChunk* out);
  void fill(int k, v1::NodeGeometry* out) const;
  void fill(int k, v1::ElementGeometry* out) const;
  void fill(const ElementGeometry::Point& p, v1::GeometryPoint* out) const;
  void fill(const ElementGeometry& g, const ElementGeometry::Line& line,
            v1::GeometryLine* out) const;
  void fill(const ElementGeometry::Arrow& a, const std::string& variable,
            v1::GeometryArrow* out) const;

  const Model& model_;
  const State state_;
  const Handles handle_of_;
  const GeometryView view_;
  const DeckFiles files_;
  const std::shared_ptr<const AttachedFiles> attached_;
  const v1::DescribeGeometryRequest request_;
  Part part_ = Part::header;
  int index_ = 0;  ///< next node or element of the part; of the cards, nodes first
  int body_ = 0;   ///< next flexible body of the element
  int point_ = 0;  ///< its next point
  AttachedFiles::const_iterator file_;  ///< next attached file
  std::size_t sent_ = 0;                ///< bytes of it that were told
};

}  // namespace mbcosim::server
