"""Shows springls in gdb: `source springls_gdb.py`, then print *ctx, ctx->model.set.s[7], ctx->model.grid, or `info springl CTX I`."""
import gdb


def vector(v):
    return "(%.6g, %.6g, %.6g)" % (float(v["x"]), float(v["y"]), float(v["z"]))


class Vector:
    def __init__(self, value):
        self.value = value

    def to_string(self):
        return vector(self.value)


class Springl:
    """Particle and triangle, voxels."""

    def __init__(self, value):
        self.value = value

    def to_string(self):
        return "springl p %s q %s %s %s" % (vector(self.value["p"]), *(vector(self.value["q"][m]) for m in range(3)))


class Grid:
    def __init__(self, value):
        self.value = value

    def to_string(self):
        size = [int(self.value["size"][k]) for k in range(3)]
        return "grid %d x %d x %d, %d active bricks" % (*size, int(self.value["active_count"]))


class Context:
    """What the model is, in a line; members after it."""

    def __init__(self, value):
        self.value = value

    def to_string(self):
        model, step = self.value["model"], self.value["step"]
        state = "a step in progress" if bool(step["active"]) else "at rest" if bool(self.value["at_rest"]) else "between steps"
        error = self.value["error"].string()
        return "model of %d springls, %s, time %g, %s%s" % (
            int(model["set"]["count"]), Grid(model["grid"]).to_string(), float(self.value["time"]), state,
            ", last error: " + error if error else "")


PRINTERS = {"springls__v3": Vector, "springls__springl": Springl, "springls__grid": Grid, "springls_context": Context}


def lookup(value):
    kind = gdb.types.get_basic_type(value.type)
    return PRINTERS[kind.tag](value) if kind.tag in PRINTERS else None


class InfoSpringl(gdb.Command):
    """info springl CTX I: all that the model has of springl I."""

    def __init__(self):
        super().__init__("info springl", gdb.COMMAND_DATA)

    def invoke(self, argument, from_tty):
        words = gdb.string_to_argv(argument)
        if len(words) != 2:
            raise gdb.GdbError("info springl CTX I")
        model, i = gdb.parse_and_eval(words[0])["model"]["set"], int(gdb.parse_and_eval(words[1]))
        if not 0 <= i < int(model["count"]):
            raise gdb.GdbError("there is no springl %d among %d" % (i, int(model["count"])))
        print("springl %d, id %d, generation %d" % (i, int(model["id"][i]), int(model["generation"][i])))
        print("  particle       " + vector(model["s"][i]["p"]))
        print("  correspondence " + vector(model["a"][i]))
        for m in range(3):
            print("  vertex %d       %s" % (m, vector(model["s"][i]["q"][m])))


import gdb.types  # noqa: E402: part of gdb

gdb.pretty_printers.append(lookup)
InfoSpringl()
