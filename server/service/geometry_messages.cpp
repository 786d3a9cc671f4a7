#include "service/geometry_messages.h"

#include "input/written_card.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

using Numbers = google::protobuf::RepeatedField<double>;

constexpr std::size_t kCardBytes = 4000;
constexpr std::size_t kMessageBytes = 512 << 10;  // a message goes out when it has grown so far

void put(const Vec3& v, Numbers* out) { out->Add(v.data(), v.data() + 3); }
void put(const Mat3& m, Numbers* out) {
  const Mat3 by_rows = m.transpose();
  out->Add(by_rows.data(), by_rows.data() + 9);
}

void fill(const ElementGeometry::Frame& f, v1::GeometryFrame* out) {
  out->set_name(f.name);
  out->set_point(f.point);
  put(f.R, out->mutable_orientation());
}

void fill(const ElementGeometry::Surface& s, v1::GeometrySurface* out) {
  out->set_name(s.name);
  out->mutable_points()->Add(s.points.begin(), s.points.end());
}

void fill(const ElementGeometry::Mass& m, v1::GeometryMass* out) {
  out->set_point(m.point);
  out->set_mass(m.m);
  put(m.moments, out->mutable_principal_moments());
  put(m.axes, out->mutable_principal_axes());
}

/// Whose card it is.
struct Owner {
  bool node = false;
  const char* family = "";
  int label = 0;
  SourceSpan where;
};

int card_count(const Model& model) {
  return static_cast<int>(model.structural.size() + model.scalars.size() + model.elements.size());
}

/// Structural nodes first, then the others, then elements.
Owner card_owner(const Model& model, std::size_t k) {
  if (k < model.structural.size()) {
    const StructuralNode& node = model.structural[k];
    return {true, "structural", node.label, node.where};
  }
  k -= model.structural.size();
  if (k < model.scalars.size()) {
    const ScalarNode& node = model.scalars[k];
    return {true, kind_name(node.kind), node.label, node.where};
  }
  const ElementRef& element = model.elements[k - model.scalars.size()];
  const ElementInfo& info = element.set->info(element.index);
  return {false, family_name(info.family), info.label, info.where};
}

void fill(const Owner& owner, const WrittenCard& card, v1::DeckCard* out) {
  out->set_of_node(owner.node);
  out->set_family(owner.family);
  out->set_label(owner.label);
  out->set_file(utf8(card.file));
  out->set_line(card.line);
  out->set_column(card.column);
  out->set_text(utf8(card.text));
  out->set_cut(card.cut);
}

}  // namespace

GeometryMessages::GeometryMessages(const Model& model, State state, Handles handles,
                                   DeckFiles files, std::shared_ptr<const AttachedFiles> attached,
                                   const v1::DescribeGeometryRequest& request)
    : model_(model),
      state_(std::move(state)),
      handle_of_(std::move(handles)),
      view_(model_, state_),
      files_(std::move(files)),
      attached_(std::move(attached)),
      request_(request) {
  if (request.has_line_samples() && (request.line_samples() < 2 || request.line_samples() > 1000))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`line_samples` must be from 2 to 1000");
  if (attached_) file_ = attached_->begin();
}

bool GeometryMessages::next(v1::DescribeGeometryReply* reply) {
  if (part_ == Part::header) {
    fill_header(reply->mutable_header());
    part_ = Part::nodes;
    return true;
  }
  if (part_ == Part::nodes) {
    if (index_ < static_cast<int>(model_.structural.size())) {
      fill_nodes(reply->mutable_nodes());
      return true;
    }
    part_ = Part::elements;
    index_ = 0;
  }
  if (part_ == Part::elements) {
    if (index_ < static_cast<int>(model_.elements.size())) {
      fill_elements(reply->mutable_elements());
      return true;
    }
    part_ = request_.without_modal_points() ? Part::cards : Part::modal_points;
    index_ = 0;
  }
  if (part_ == Part::modal_points) {
    if (find_modes()) {
      fill_modal_points(reply->mutable_modal_points());
      return true;
    }
    part_ = Part::cards;
    index_ = 0;
  }
  if (part_ == Part::cards) {
    if (request_.cards()) fill_cards(reply->mutable_cards());
    if (reply->cards().cards_size() > 0) return true;
    part_ = attached_ && request_.attachments() ? Part::attachments : Part::end;
  }
  return part_ == Part::attachments && next_attachment(reply->mutable_attachment());
}

void GeometryMessages::fill_header(v1::GeometryHeader* h) const {
  h->set_model_digest(digest_text(model_.digest));
  h->set_step(state_.step);
  h->set_time(state_.time);
  h->set_nodes(static_cast<int>(model_.structural.size()));
  h->set_elements(static_cast<int>(model_.elements.size()));
  if (model_.structural.empty()) return;
  Vec3 lower = view_.node(0).x, upper = lower;
  for (std::size_t k = 1; k < model_.structural.size(); ++k) {
    const Vec3 x = view_.node(static_cast<int>(k)).x;
    lower = lower.cwiseMin(x);
    upper = upper.cwiseMax(x);
  }
  put(lower, h->mutable_lower());
  put(upper, h->mutable_upper());
}

void GeometryMessages::fill_nodes(v1::NodeGeometryList* out) {
  const int count = static_cast<int>(model_.structural.size());
  for (std::size_t bytes = 0; index_ < count && bytes < kMessageBytes; ++index_) {
    fill(index_, out->add_nodes());
    bytes += out->nodes().rbegin()->ByteSizeLong();
  }
}

void GeometryMessages::fill(int k, v1::NodeGeometry* out) const {
  const NodeGeometry n = view_.node(k);
  out->set_label(n.label);
  out->set_kind(n.kind);
  out->set_name(utf8(n.name));
  put(n.x, out->mutable_position());
  const std::string prefix = "node.structural." + std::to_string(n.label) + ".";
  out->set_position_handle(handle_of_(prefix + "X"));
  if (!n.oriented) return;
  put(n.R, out->mutable_orientation());
  out->set_orientation_handle(handle_of_(prefix + "R"));
}

void GeometryMessages::fill_elements(v1::ElementGeometryList* out) {
  const int count = static_cast<int>(model_.elements.size());
  for (std::size_t bytes = 0; index_ < count && bytes < kMessageBytes; ++index_) {
    fill(index_, out->add_elements());
    bytes += out->elements().rbegin()->ByteSizeLong();
  }
}

void GeometryMessages::fill(int k, v1::ElementGeometry* out) const {
  const ElementInfo& info = model_.elements[k].set->info(model_.elements[k].index);
  out->set_family(family_name(info.family));
  out->set_type(info.type);
  out->set_label(info.label);
  out->set_name(utf8(info.name));
  const ElementGeometry g = view_.element(k);
  for (const ElementGeometry::Point& p : g.points) fill(p, out->add_points());
  for (const ElementGeometry::Frame& f : g.frames) server::fill(f, out->add_frames());
  for (const ElementGeometry::Line& l : g.lines) fill(g, l, out->add_lines());
  for (const ElementGeometry::Surface& s : g.surfaces) server::fill(s, out->add_surfaces());
  for (const ElementGeometry::Mass& m : g.masses) server::fill(m, out->add_masses());
  const std::vector<std::string> variables = view_.arrow_variables(k);
  for (const ElementGeometry::Arrow& a : g.arrows) fill(a, variables[a.arrow], out->add_arrows());
}

/// Cards of nodes and elements from `index_` on; none: there are no more.
void GeometryMessages::fill_cards(v1::DeckCardList* out) {
  const int count = card_count(model_);
  for (std::size_t bytes = 0; index_ < count && bytes < kMessageBytes; ++index_) {
    const Owner owner = card_owner(model_, index_);
    const auto card = written_card(files_, owner.where, kCardBytes);
    if (!card) continue;
    server::fill(owner, *card, out->add_cards());
    bytes += out->cards().rbegin()->ByteSizeLong();
  }
}

/// False: all files were told.
bool GeometryMessages::next_attachment(v1::FileChunk* out) {
  if (file_ == attached_->end()) return false;
  const auto& [path, data] = *file_;
  out->set_path(utf8(path));
  out->set_data(data.substr(sent_, kMessageBytes));
  sent_ += kMessageBytes;
  if (sent_ < data.size()) return true;
  sent_ = 0;
  ++file_;
  return true;
}

void GeometryMessages::fill(const ElementGeometry::Point& p, v1::GeometryPoint* out) const {
  out->set_name(utf8(p.name));
  if (p.node >= 0) out->set_node_label(model_.structural[p.node].label);
  put(p.offset, out->mutable_offset());
  put(view_.position(p), out->mutable_position());
}

void GeometryMessages::fill(const ElementGeometry& g, const ElementGeometry::Line& line,
                            v1::GeometryLine* out) const {
  out->set_name(line.name);
  out->mutable_points()->Add(line.points.begin(), line.points.end());
  out->set_curved(line.curved);
  if (!line.variable.empty()) out->set_value_handle(handle_of_(line.variable));
  if (!line.curved || !request_.has_line_samples()) return;
  for (const Vec3& x : view_.trace(g, line, request_.line_samples())) put(x, out->mutable_trace());
}

void GeometryMessages::fill(const ElementGeometry::Arrow& a, const std::string& variable,
                            v1::GeometryArrow* out) const {
  out->set_point(a.point);
  out->set_handle(handle_of_(variable));
  out->set_reversed(a.sign < 0);
  out->set_moment(variable.ends_with(".M"));
}

/// Goes on to the next flexible body that has points left; false: there is none.
bool GeometryMessages::find_modes() {
  for (; index_ < static_cast<int>(model_.elements.size()); ++index_, body_ = point_ = 0) {
    const ElementGeometry g = view_.element(index_);
    for (; body_ < static_cast<int>(g.modes.size()); ++body_, point_ = 0)
      if (point_ < static_cast<int>(g.modes[body_].labels->size())) return true;
  }
  return false;
}

void GeometryMessages::fill_modal_points(v1::ModalPoints* out) {
  const ElementGeometry g = view_.element(index_);
  const ElementGeometry::Modes& m = g.modes[body_];
  begin_modal_points(m, out);
  const int count = static_cast<int>(m.labels->size());
  for (std::size_t bytes = 0; point_ < count && bytes < kMessageBytes; ++point_) {
    out->add_labels(utf8((*m.labels)[point_]));
    put(Vec3(m.positions->col(point_)), out->mutable_positions());
    for (int row = 0; row < 3; ++row)
      for (int mode = 0; mode < m.shapes->cols(); ++mode)
        out->add_shapes((*m.shapes)(6 * point_ + row, mode));
    bytes += 8 * (3 + 3 * m.shapes->cols()) + (*m.labels)[point_].size() + 2;
  }
}

void GeometryMessages::begin_modal_points(const ElementGeometry::Modes& m,
                                          v1::ModalPoints* out) const {
  out->set_joint_label(model_.elements[index_].set->info(model_.elements[index_].index).label);
  if (m.node >= 0) {
    out->set_node_label(model_.structural[m.node].label);
  } else {
    put(m.x0, out->mutable_fixed_position());
    put(m.R0, out->mutable_fixed_orientation());
  }
  for (const std::string& name : view_.amplitude_variables(index_, m))
    out->add_amplitude_handles(handle_of_(name));
  out->set_count(static_cast<int>(m.labels->size()));
  out->set_first(point_);
}

}  // namespace mbcosim::server
