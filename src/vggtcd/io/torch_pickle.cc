// SPDX-License-Identifier: Apache-2.0
// torch_pickle: a stack machine of about forty opcodes over an arena of values.
#include "vggtcd/io/torch_pickle.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "vggtcd/core/error.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

using Kind = PickleValue::Kind;

constexpr size_t kMaxPickleBytes = 64'000'000;
constexpr size_t kMaxRank = 16;
constexpr size_t kMaxValues = 1'000'000;  // VGGT-1B has about 60 000

// The globals that are accepted, "module name". They are names only: what they stand for is done by
// reduce() and load_storage() below.
constexpr std::string_view kOrderedDict = "collections OrderedDict",
                           kRebuildTensor = "torch._utils _rebuild_tensor_v2",
                           kRebuildParameter = "torch._utils _rebuild_parameter",
                           kSize = "torch Size";
constexpr std::array<std::string_view, 4> kFunctions = {kOrderedDict, kRebuildTensor,
                                                        kRebuildParameter, kSize};
constexpr std::array<std::pair<std::string_view, DType>, 10> kStorages = {
    {{"torch FloatStorage", DType::kF32},
     {"torch HalfStorage", DType::kF16},
     {"torch BFloat16Storage", DType::kBF16},
     {"torch DoubleStorage", DType::kF64},
     {"torch LongStorage", DType::kI64},
     {"torch IntStorage", DType::kI32},
     {"torch ShortStorage", DType::kI16},
     {"torch CharStorage", DType::kI8},
     {"torch ByteStorage", DType::kU8},
     {"torch BoolStorage", DType::kBool}}};

class Machine {
 public:
  Machine(std::span<const std::byte> bytes, const std::string& name)
      : bytes_(bytes.first(std::min(bytes.size(), kMaxPickleBytes))), name_(name) {}

  Pickle run() {
    while (true) {
      const uint8_t opcode = take<uint8_t>();
      if (opcode == '.') break;
      step(opcode);
    }
    if (stack_.size() != 1 || !marks_.empty()) fail("it does not leave exactly one value");
    pickle_.root = stack_[0];
    pickle_.size = at_;
    return std::move(pickle_);
  }

 private:
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    throw_error(ErrorCode::kWeights, "{}: pickle not accepted at byte {}: {}", name_, at_,
                fmt::format(format, std::forward<Args>(args)...));
  }

  // --- the bytes ---

  std::string_view take_text(uint64_t size) {
    if (size > bytes_.size() - at_) fail("it is cut off or larger than {} bytes", kMaxPickleBytes);
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + at_, size);
    at_ += size;
    return text;
  }

  template <typename T>
  T take() {
    T value;
    std::memcpy(&value, take_text(sizeof(T)).data(), sizeof(T));
    return value;
  }

  std::string_view take_line() {
    const std::string_view rest(reinterpret_cast<const char*>(bytes_.data()) + at_,
                                bytes_.size() - at_);
    const size_t end = rest.find('\n');
    if (end == std::string_view::npos) fail("a line is cut off");
    return take_text(end + 1).substr(0, end);
  }

  int64_t take_long(uint64_t size) {  // little-endian two's complement of any length
    const std::string_view digits = take_text(size);
    if (size > sizeof(int64_t)) fail("an integer of {} bytes", size);
    if (digits.empty()) return 0;
    uint64_t value = digits.back() < 0 ? ~uint64_t{0} : 0;
    for (size_t i = digits.size(); i-- > 0;) {
      value = value << 8 | static_cast<unsigned char>(digits[i]);
    }
    return static_cast<int64_t>(value);
  }

  // --- the values ---

  void push(PickleValue* value) {
    if (stack_.size() >= kMaxValues) fail("a stack of more than {} values", kMaxValues);
    stack_.push_back(value);
  }
  PickleValue* make_and_push(Kind kind) {
    if (pickle_.values.size() >= kMaxValues) fail("more than {} values", kMaxValues);
    PickleValue* value = &pickle_.values.emplace_back();
    value->kind = kind;
    push(value);
    return value;
  }

  // What lies above the last mark belongs to the opcode that takes the mark.
  size_t floor() const { return marks_.empty() ? 0 : marks_.back(); }

  std::vector<const PickleValue*> pop(size_t count) {
    if (stack_.size() - floor() < count) fail("a value is taken from an empty stack");
    std::vector<const PickleValue*> items(stack_.end() - static_cast<std::ptrdiff_t>(count),
                                          stack_.end());
    stack_.resize(stack_.size() - count);
    return items;
  }
  PickleValue* top() {
    if (stack_.size() <= floor()) fail("a value is expected on an empty stack");
    return stack_.back();
  }
  std::vector<const PickleValue*> pop_mark() {
    if (marks_.empty()) fail("a mark is expected");
    const auto begin = stack_.begin() + static_cast<std::ptrdiff_t>(marks_.back());
    std::vector<const PickleValue*> items(begin, stack_.end());
    stack_.erase(begin, stack_.end());
    marks_.pop_back();
    return items;
  }
  void extend(Kind kind, const std::vector<const PickleValue*>& items) {
    PickleValue* container = top();
    if (container->kind != kind) fail("items are added to a {}", pickle_kind_name(container->kind));
    if (kind == Kind::kDict && items.size() % 2 != 0) fail("a dict gets a key without a value");
    container->items.insert(container->items.end(), items.begin(), items.end());
  }

  void memoize(uint32_t index) {
    if (memo_.size() >= kMaxValues) fail("more than {} remembered values", kMaxValues);
    memo_[index] = top();
  }
  void recall(uint32_t index) {
    const auto found = memo_.find(index);
    if (found == memo_.end()) fail("value {} is recalled but was never remembered", index);
    push(found->second);
  }

  void push_global(std::string_view module, std::string_view attribute) {
    const std::string global = std::string(module) + " " + std::string(attribute);
    const auto* function = std::ranges::find(kFunctions, global);
    if (function != kFunctions.end()) {
      make_and_push(Kind::kGlobal)->text = *function;
      return;
    }
    const auto* storage = std::ranges::find(kStorages, global, [](auto& e) { return e.first; });
    if (storage == kStorages.end()) {
      fail("global {} is none that weights need; it was not executed", quote(global));
    }
    PickleValue* value = make_and_push(Kind::kGlobal);
    value->text = storage->first;
    value->dtype = storage->second;
  }

  void step(uint8_t opcode);
  bool step_scalar(uint8_t opcode);
  bool step_container(uint8_t opcode);
  bool step_memo(uint8_t opcode);
  bool step_object(uint8_t opcode);
  void reduce();
  void rebuild_tensor(const std::vector<const PickleValue*>& arguments);
  void load_storage();

  std::span<const std::byte> bytes_;
  const std::string& name_;
  size_t at_ = 0;
  Pickle pickle_;
  std::vector<PickleValue*> stack_;
  std::vector<size_t> marks_;
  std::unordered_map<uint32_t, PickleValue*> memo_;
};

void Machine::step(uint8_t opcode) {
  if (step_scalar(opcode) || step_container(opcode) || step_memo(opcode) || step_object(opcode)) {
    return;
  }
  fail("opcode 0x{:02x} is none that weights need", opcode);
}

bool Machine::step_scalar(uint8_t opcode) {
  switch (opcode) {
    case 'N':  // NONE
      make_and_push(Kind::kNone);
      return true;
    case 0x88:  // NEWTRUE
    case 0x89:  // NEWFALSE
      make_and_push(Kind::kBool)->integer = opcode == 0x88 ? 1 : 0;
      return true;
    case 'K':  // BININT1
      make_and_push(Kind::kInt)->integer = take<uint8_t>();
      return true;
    case 'M':  // BININT2
      make_and_push(Kind::kInt)->integer = take<uint16_t>();
      return true;
    case 'J':  // BININT
      make_and_push(Kind::kInt)->integer = take<int32_t>();
      return true;
    case 0x8a:  // LONG1
      make_and_push(Kind::kInt)->integer = take_long(take<uint8_t>());
      return true;
    case 0x8b:  // LONG4
      make_and_push(Kind::kInt)->integer = take_long(take<uint32_t>());
      return true;
    case 'G':  // BINFLOAT, the one big-endian number
      make_and_push(Kind::kFloat)->real =
          std::bit_cast<double>(__builtin_bswap64(take<uint64_t>()));
      return true;
    case 'X':  // BINUNICODE
    case 'T':  // BINSTRING
    case 'B':  // BINBYTES
      make_and_push(Kind::kString)->text = take_text(take<uint32_t>());
      return true;
    case 0x8c:  // SHORT_BINUNICODE
    case 'U':   // SHORT_BINSTRING
    case 'C':   // SHORT_BINBYTES
      make_and_push(Kind::kString)->text = take_text(take<uint8_t>());
      return true;
    case 0x8d:  // BINUNICODE8
    case 0x8e:  // BINBYTES8
      make_and_push(Kind::kString)->text = take_text(take<uint64_t>());
      return true;
    default:
      return false;
  }
}

bool Machine::step_container(uint8_t opcode) {
  switch (opcode) {
    case '}':  // EMPTY_DICT
      make_and_push(Kind::kDict);
      return true;
    case ']':  // EMPTY_LIST
      make_and_push(Kind::kList);
      return true;
    case ')':  // EMPTY_TUPLE
      make_and_push(Kind::kTuple);
      return true;
    case '(':  // MARK
      if (marks_.size() >= kMaxValues) fail("more than {} marks", kMaxValues);
      marks_.push_back(stack_.size());
      return true;
    case 't': {  // TUPLE
      std::vector<const PickleValue*> items = pop_mark();
      make_and_push(Kind::kTuple)->items = std::move(items);
      return true;
    }
    case 0x85:  // TUPLE1
    case 0x86:  // TUPLE2
    case 0x87:  // TUPLE3
    {
      std::vector<const PickleValue*> items = pop(opcode - 0x84u);
      make_and_push(Kind::kTuple)->items = std::move(items);
      return true;
    }
    case 'a':  // APPEND
      extend(Kind::kList, pop(1));
      return true;
    case 'e':  // APPENDS
      extend(Kind::kList, pop_mark());
      return true;
    case 's':  // SETITEM
      extend(Kind::kDict, pop(2));
      return true;
    case 'u':  // SETITEMS
      extend(Kind::kDict, pop_mark());
      return true;
    default:
      return false;
  }
}

bool Machine::step_memo(uint8_t opcode) {
  switch (opcode) {
    case 'q':  // BINPUT
      memoize(take<uint8_t>());
      return true;
    case 'r':  // LONG_BINPUT
      memoize(take<uint32_t>());
      return true;
    case 0x94:  // MEMOIZE
      memoize(static_cast<uint32_t>(memo_.size()));
      return true;
    case 'h':  // BINGET
      recall(take<uint8_t>());
      return true;
    case 'j':  // LONG_BINGET
      recall(take<uint32_t>());
      return true;
    default:
      return false;
  }
}

bool Machine::step_object(uint8_t opcode) {
  switch (opcode) {
    case 0x80: {  // PROTO
      const int protocol = take<uint8_t>();
      if (protocol < 2 || protocol > 5) fail("expected protocol 2 to 5, found {}", protocol);
      return true;
    }
    case 0x95:  // FRAME: a hint about buffering
      take<uint64_t>();
      return true;
    case 'c': {  // GLOBAL
      const std::string_view module = take_line();
      push_global(module, take_line());
      return true;
    }
    case 0x93: {  // STACK_GLOBAL
      const std::vector<const PickleValue*> names = pop(2);
      push_global(names[0]->text, names[1]->text);
      return true;
    }
    case 'Q':  // BINPERSID
      load_storage();
      return true;
    case 'R':  // REDUCE
      reduce();
      return true;
    case 'b':  // BUILD: the attributes of a dict (a state_dict has _metadata), not needed
      pop(1);
      if (top()->kind != Kind::kDict) fail("attributes of a {}", pickle_kind_name(top()->kind));
      return true;
    default:
      return false;
  }
}

// function(*arguments), for the four functions that are accepted.
void Machine::reduce() {
  const std::vector<const PickleValue*> call = pop(2);
  if (call[0]->kind != Kind::kGlobal || call[1]->kind != Kind::kTuple) {
    fail("a call of a {}", pickle_kind_name(call[0]->kind));
  }
  const std::string_view function = call[0]->text;
  const std::vector<const PickleValue*>& arguments = call[1]->items;
  if (function == kOrderedDict && arguments.empty()) {
    make_and_push(Kind::kDict);
  } else if (function == kRebuildTensor) {
    rebuild_tensor(arguments);
  } else if (function == kRebuildParameter && !arguments.empty() &&
             arguments[0]->kind == Kind::kTensor) {
    make_and_push(Kind::kTensor)->items = arguments[0]->items;
  } else if (function == kSize && arguments.size() == 1 && arguments[0]->kind == Kind::kTuple &&
             arguments[0]->items.size() <= kMaxRank) {
    make_and_push(Kind::kTuple)->items = arguments[0]->items;
  } else {
    fail("{} with {} arguments of the wrong kind", quote(function), arguments.size());
  }
}

// _rebuild_tensor_v2(storage, offset, sizes, strides, requires_grad, backward_hooks, ...)
void Machine::rebuild_tensor(const std::vector<const PickleValue*>& arguments) {
  constexpr std::array<Kind, 4> kKinds = {Kind::kStorage, Kind::kInt, Kind::kTuple, Kind::kTuple};
  if (arguments.size() < kKinds.size()) fail("a tensor of {} parts", arguments.size());
  for (size_t i = 0; i < kKinds.size(); ++i) {
    if (arguments[i]->kind != kKinds[i]) {
      fail("part {} of a tensor is a {}, expected a {}", i, pickle_kind_name(arguments[i]->kind),
           pickle_kind_name(kKinds[i]));
    }
  }
  make_and_push(Kind::kTensor)->items = {arguments.begin(), arguments.begin() + kKinds.size()};
}

// ("storage", torch.FloatStorage, key, location, number of elements[, view of another storage])
void Machine::load_storage() {
  const std::vector<const PickleValue*> id = pop(1);
  const std::vector<const PickleValue*>& parts = id[0]->items;
  const bool sound = id[0]->kind == Kind::kTuple && (parts.size() == 5 || parts.size() == 6) &&
                     parts[0]->text == "storage" && parts[1]->kind == Kind::kGlobal &&
                     parts[2]->kind == Kind::kString && parts[4]->kind == Kind::kInt &&
                     parts[4]->integer >= 0 && (parts.size() == 5 || parts[5]->kind == Kind::kNone);
  if (!sound || !parts[1]->text.ends_with("Storage")) fail("a storage that PyTorch does not write");
  PickleValue* storage = make_and_push(Kind::kStorage);
  storage->dtype = parts[1]->dtype;
  storage->text = parts[2]->text;
  storage->integer = parts[4]->integer;
}

}  // namespace

std::string_view pickle_kind_name(PickleValue::Kind kind) {
  constexpr std::array<std::string_view, 10> kNames = {
      "None", "bool", "int", "float", "string", "list", "tuple", "dict", "global", "storage"};
  const size_t index = static_cast<size_t>(kind);
  return index < kNames.size() ? kNames[index] : "tensor";
}

Pickle read_torch_pickle(std::span<const std::byte> bytes, const std::string& name) {
  return Machine(bytes, name).run();
}

}  // namespace vggtcd
