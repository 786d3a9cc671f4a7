#include "input/plugin.h"

#include <vector>

#include "input/evaluate.h"
#include "input/functions.h"
#include "input/lexer.h"
#include "input/model_functions.h"
#include "input/reading.h"
#include "input/syntax.h"
#include "model/family.h"
#include "model/model.h"
#include "model/registry.h"

namespace mbcosim {

namespace {

struct Item {
  std::string_view text;  // without blanks around
  std::size_t where;      // offset in the expression
};

std::vector<Item> split(std::string_view text, std::size_t where) {
  std::vector<Item> items;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && text[i] == '"') i = std::min(skip_string(text, i), text.size());
    if (i < text.size() && text[i] != ',') continue;
    std::size_t first = begin, last = std::min(i, text.size());
    while (first < last && is_blank(text[first])) ++first;
    while (last > first && is_blank(text[last - 1])) --last;
    items.push_back({text.substr(first, last - first), where + first});
    begin = i + 1;
  }
  return items;
}

/// Removes the quotes; `\n` inside them is a line end.
std::string unquoted(std::string_view s) {
  if (s.size() < 2 || s.front() != '"' || s.back() != '"') return std::string(s);
  std::string r;
  for (std::size_t i = 1; i + 1 < s.size(); ++i) {
    if (s[i] == '\\' && s[i + 1] == 'n') {
      r += '\n';
      ++i;
    } else {
      r += s[i];
    }
  }
  return r;
}

[[noreturn]] void fail(const Item& item, const std::string& message) {
  throw ExpressionError(item.where, std::max<std::size_t>(item.text.size(), 1), message);
}

/// Reads the items of one plugin variable in order.
class Reader {
 public:
  Reader(Reading& reading, std::string_view text, std::size_t where)
      : reading_(reading), whole_{text, where}, items_(split(text, where)) {}

  Symbol& declare() {
    if (items_.size() < 2 || items_[0].text.empty() || items_[1].text.empty())
      fail(whole_, "malformed plugin variable: kind and name expected");
    const std::string kind = normalized(items_[0].text);
    if (kind != "dof" && kind != "node" && kind != "element")
      fail(items_[0], "unknown kind of plugin variable \"" + std::string(items_[0].text) +
                          "\"; there are dof, node and element");
    check_name();
    if (items_.size() < 4)
      fail(whole_, "malformed plugin variable: label and type expected after the name");
    if (!reading_.model_available() || !reading_.builder())
      fail(whole_,
           "plugin variables are not available before the end of the \"initial value\" block");
    Symbol s;
    s.name = items_[1].text;
    s.value = 0.0;
    s.where = reading_.expression_span(items_[1].where, items_[1].text.size());
    try {
      s.plugin = kind == "dof" ? dof() : datum(kind == "node");
    } catch (const ExpressionError&) {
      throw;
    } catch (const EvaluationError& e) {
      fail(items_[2], e.what());
    }
    if (next_ < items_.size())
      fail(items_[next_], "unexpected argument \"" + excerpt(items_[next_].text) + '"');
    return reading_.symbols.declare(std::move(s));
  }

 private:
  void check_name() {
    const std::string_view name = items_[1].text;
    if (!is_word_start(name[0]) || skip_identifier(name, 0) != name.size())
      fail(items_[1], "\"" + excerpt(name) + "\" is not a name of a variable");
    if (find_function(name)) fail(items_[1], "\"" + std::string(name) + "\" is a function name");
    if (const Symbol* known = reading_.symbols.find(name))
      fail(items_[1], "variable \"" + std::string(name) + "\" already declared" +
                          (known->where.file >= 0 ? " at " + reading_.place(known->where) : ""));
  }

  int integer(const Item& item, const char* what) {
    const Value v = evaluate_part(reading_, item.text, item.where);
    if (const auto* i = std::get_if<std::int32_t>(&v)) return *i;
    fail(item, std::string(what) + " must be an integer");
  }

  int type(const Item& item) {
    const int t = node_type(item.text);
    if (t < 0) fail(item, "unknown node type \"" + excerpt(item.text) + '"');
    return t;
  }

  DrivePtr dof() {
    const int label = integer(items_[2], "label");
    const int kind = type(items_[3]);
    next_ = 4;
    int component = 0;
    if (kind == 0) {
      if (next_ >= items_.size()) fail(items_.back(), "index of the degree of freedom expected");
      component = integer(items_[next_++], "index");
    }
    if (next_ >= items_.size()) fail(items_.back(), "\"algebraic\" or \"differential\" expected");
    const std::string order = normalized(items_[next_].text);
    if (order != "algebraic" && order != "differential")
      fail(items_[next_], "\"algebraic\" or \"differential\" expected");
    ++next_;
    return dof_value(reading_.builder()->model(), kind, label, component, order == "differential",
                     previous());
  }

  bool previous() {
    if (next_ >= items_.size()) return false;
    const std::string option = normalized(items_[next_].text);
    if (option != "prev=true" && option != "prev=false")
      fail(items_[next_], "\"prev=true\" or \"prev=false\" expected");
    ++next_;
    return option == "prev=true";
  }

  DrivePtr datum(bool is_node) {
    const int label = integer(items_[2], "label");
    const FamilyFacts* family = nullptr;
    int kind = 0;
    if (is_node)
      kind = type(items_[3]);
    else if (family = family_by_function(normalized(items_[3].text)); !family)
      fail(items_[3], "unknown element type \"" + excerpt(items_[3].text) + '"');
    next_ = 4;
    std::string name;
    int index = 0;
    if (next_ < items_.size()) read_datum_choice(items_[next_++], &name, &index);
    const Model& model = reading_.builder()->model();
    return is_node ? node_datum(model, kind, label, name, index)
                   : element_datum(model, family->family, true, label, name, index);
  }

  void read_datum_choice(const Item& item, std::string* name, int* index) {
    const std::size_t equal = item.text.find('=');
    const std::string key = normalized(item.text.substr(0, std::min(equal, item.text.size())));
    if (equal == std::string_view::npos || (key != "string" && key != "name" && key != "index"))
      fail(item, "\"string=...\" or \"index=...\" expected");
    std::size_t begin = equal + 1;
    while (begin < item.text.size() && is_blank(item.text[begin])) ++begin;
    const Item value{item.text.substr(begin), item.where + begin};
    if (key == "index")
      *index = integer(value, "index");
    else
      *name = unquoted(value.text);
  }

  Reading& reading_;
  Item whole_;
  std::vector<Item> items_;
  std::size_t next_ = 4;
};

}  // namespace

Symbol& declare_plugin(Reading& reading, std::string_view text, std::size_t where) {
  return Reader(reading, text, where).declare();
}

}  // namespace mbcosim
