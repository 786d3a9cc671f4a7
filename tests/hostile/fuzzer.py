"""Random requests made from the descriptors of the service, with enough memory of what exists to reach living simulations."""
from google.protobuf.descriptor import FieldDescriptor as F

NUMBERS = [0, 1, -1, 2, 7, 63, 100, 255, 2**31 - 1, -2**31]
LARGE = [2**63 - 1, -2**63, 2**53, 9_300_000_000, 2**33]  # for 64 bits; beyond the seconds that 64 bits of nanoseconds hold
REALS = [0.0, -0.0, 1.0, -1.0, 1e-3, 1e300, -1e300, 1e-308, float("inf"), float("-inf"), float("nan")]
TEXTS = ["", "a", "x" * 300, "../../etc/passwd", "\u0000", "simulations/none", "é☃"]


class Fuzzer:
    """Fills messages. `known` maps field names to values that exist; they are taken most of the time."""

    def __init__(self, random):
        self.random = random
        self.known = {"handles": list(range(30)), "inputs": [0, 1], "outputs": [0, 1, 2], "handle": [0, 1, 2], "node_labels": [1]}

    def learn(self, field, value):
        values = self.known.setdefault(field, [])
        values.append(value)
        del values[:-20]

    def number(self, field):
        if self.random.random() < 0.8 and self.known.get(field.name):
            return self.random.choice(self.known[field.name])
        if field.name in ("steps", "count"):  # a run is to end
            return self.random.choice([0, 1, 3, 200, -1])
        wide = field.cpp_type in (F.CPPTYPE_INT64, F.CPPTYPE_UINT64)
        low = 0 if field.cpp_type in (F.CPPTYPE_UINT32, F.CPPTYPE_UINT64) else -2**63
        return max(low, self.random.choice(NUMBERS + LARGE if wide else NUMBERS))

    def text(self, field):
        if self.random.random() < 0.85 and self.known.get(field.name):
            return self.random.choice(self.known[field.name])
        return self.random.choice(TEXTS)

    def value(self, field, depth):
        kind = field.cpp_type
        if kind == F.CPPTYPE_MESSAGE:
            return self.message(field.message_type._concrete_class, depth + 1)
        if kind == F.CPPTYPE_ENUM:
            return self.random.choice([v.number for v in field.enum_type.values] + [99])
        if kind == F.CPPTYPE_BOOL:
            return self.random.random() < 0.5
        if kind in (F.CPPTYPE_DOUBLE, F.CPPTYPE_FLOAT):
            return self.random.choice(REALS) if self.random.random() < 0.5 else self.random.uniform(-2, 2)
        if kind == F.CPPTYPE_STRING:
            text = self.text(field)
            return text.encode() if field.type == F.TYPE_BYTES else text
        return self.number(field)

    def message(self, cls, depth=0):
        message = cls()
        if depth > 5:
            return message
        chosen = {oneof.name: self.random.choice(oneof.fields).name for oneof in cls.DESCRIPTOR.oneofs}
        for field in cls.DESCRIPTOR.fields:
            oneof = field.containing_oneof
            if oneof is not None and chosen[oneof.name] != field.name:
                continue
            named = field.name in ("simulation", "name", "snapshot")
            if self.random.random() > (0.95 if named or oneof is not None else 0.4):
                continue
            self.put(message, field, depth)
        return message

    def mutated(self, data):
        """Bytes of a message, some of them changed: it may not be one any more, or another."""
        data = bytearray(data)
        for _ in range(self.random.choice([1, 1, 2, 10])):
            at = self.random.randrange(len(data) + 1)
            change = self.random.randrange(5)
            if change == 0 and at < len(data):
                data[at] ^= 1 << self.random.randrange(8)
            elif change == 1:
                del data[at:at + self.random.choice([1, 2, 8])]
            elif change == 2:
                data[at:at] = self.random.randbytes(self.random.choice([1, 2, 8]))
            elif change == 3:
                data[at:at] = data[self.random.randrange(len(data) + 1):][:64]  # fields repeated, or one message in another
            else:
                del data[at:]
        return bytes(data)

    def put(self, message, field, depth):
        try:
            if field.label == F.LABEL_REPEATED:
                if field.message_type is not None and field.message_type.GetOptions().map_entry:
                    return
                target = getattr(message, field.name)
                for _ in range(self.random.choice([0, 1, 1, 2, 5])):
                    value = self.value(field, depth)
                    target.append(value)
            elif field.cpp_type == F.CPPTYPE_MESSAGE:
                getattr(message, field.name).CopyFrom(self.value(field, depth))
            else:
                setattr(message, field.name, self.value(field, depth))
        except (ValueError, TypeError, UnicodeEncodeError):  # out of the field's range: left out
            pass
