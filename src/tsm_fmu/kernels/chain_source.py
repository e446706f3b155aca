"""The text of a chain's kernel module."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

from ..effects import sizes_of, starts_of
from ..effects.coordinates import Motion, MotionParams
from ..models.contract import SLIDING_SHARE, variables
from .attached import Attached
from .chain_dependencies import dependencies
from .drives import MEANINGS, STARTS, Drive
from .kernel import Kernel


class Writer:
    """Writes the module; each method is one passage of it."""

    def __init__(self, base: Kernel, attached: list[Attached], drives: tuple[Drive, ...] = ()) -> None:
        self.base = base
        self.module = base.module
        self.attached = attached
        self.model_file = base.module.__name__.rsplit(".", 1)[-1]
        self.inputs = self.module.Inputs._fields
        self.roles = base.roles
        self.load = self.roles.load
        self.load_is_output = self.load in self.module.Outputs._fields
        self.friction = [(n, a) for n, a in enumerate(attached) if not a.channel]
        self.position = self.roles.motion
        self.drive = self.roles.drive
        self.needs = {f for a in attached for f in a.module.Inputs._fields}
        self.ways = [a for a in attached if acts_on_way(base, a)]
        self.moves = bool(self.needs & set(Motion._fields))
        every = dict.fromkeys((*drives, *(d for a in attached for d in a.drives)))
        self.drives = tuple({d.column: d for d in every if d.column not in self.inputs}.values())
        self.listens = drives

    @property
    def feeds_back(self) -> bool:
        """Whether an effect on the friction reads the load that the model estimates from the friction."""
        readers = (a for _, a in self.friction if "load" in a.takes and not a.drive("load"))
        return self.load_is_output and any(readers)

    @property
    def can_hold(self) -> bool:
        """Whether the model, where its parameter ``hold`` is 1, keeps a load that effects on the friction change."""
        return bool(self.roles.held_load and self.friction)

    @property
    def slides_later(self) -> bool:
        """Whether friction of effects may still build up where that of a model that holds a load slides."""
        return self.can_hold and bool(self._building_up())

    def _building_up(self) -> list[tuple[int, Attached]]:
        """Effects on the friction that build up over the presliding distance."""
        return [(number, a) for number, a in self.friction if "z" in a.takes]

    def text(self) -> str:
        return "\n".join(
            [
                f'"""{self.base.name} with {", ".join(self._added())} (written by chain.py)."""',
                "",
                *self._imports(),
                "",
                f'NAME = "{self.base.name}"',
                f"EFFECTS = {tuple(a.spec for a in self.attached)!r}",
                f"DRIVES = {tuple(tuple(d) for d in self.listens)!r}",
                *self._roles(),
                *self._classes(),
                *self._conditions(),
                *self._friction_function("start"),
                *self._friction_function("step"),
                *self._load_function("start"),
                *self._load_function("step"),
                *self._function("start"),
                *self._function("step"),
                "",
            ]
        )

    # -- declarations

    def _roles(self) -> list[str]:
        if not hasattr(self.module, "ROLES"):
            return []
        initial = tuple(a.prefix.replace("__", ".") + name for a in self.attached for name in starts_of(a.module))
        return [
            f"ROLES = model_ROLES._replace(depends={dependencies(self.base, self.attached)!r}, "
            f"initial=(*model_ROLES.initial, *{initial!r}))"
        ]

    def _added(self) -> list[str]:
        return [a.spec for a in self.attached] or [f"the input {d.column}" for d in self.drives]

    def _imports(self) -> list[str]:
        names = ["Params", "State", "Inputs", "Outputs", "start", "step"]
        optional = [n for n in ("ROLES", "CONDITIONS") if hasattr(self.module, n)]
        lines = [f"from .{self.model_file} import {n} as model_{n}" for n in names + optional]
        lines += [f"from .{self.model_file} import PRESETS"]
        lines += [imported(f, f"model_friction_{way}") for f, way in self._port("friction", "read", "write")]
        lines += [imported(f, f"model_load_{way}") for f, way in self._port("held_load", "level", "between", "write")]
        channels = dict.fromkeys(a.channel for a in self.attached if a.on_lost_motion)
        lines += [imported(self.roles.lost_motion[c], f"model_lost_{c}") for c in channels]
        for number, a in enumerate(self.attached):
            file = a.module.__name__.rsplit(".", 1)[-1]
            optional = ["CONDITIONS"] if hasattr(a.module, "CONDITIONS") else []
            lines += [f"from ..effects.{file} import {n} as e{number}_{n}" for n in [*names, "NEUTRAL", *optional]]
        lines += ["from ..effects.coordinates import Motion, MotionParams"]
        lines += ["from ..effects.coordinates import motion_from_position, motion_from_speed"]
        lines += ["from ..effects.coordinates import Way"] if self.ways else []
        lines += ["from .laws.velocity_filter import filtered_slope"]
        if self.drives:
            lines += ["from typing import Annotated, NamedTuple", "from .contract import Quantity"]
        return [*lines, "from .joined import Part, joined"]

    def _port(self, role: str, *ways: str) -> list[tuple[Any, str]]:
        """Functions of a port of the model, with what they are for; none where it has none or no effect uses it."""
        port = getattr(self.roles, role)
        return [(getattr(port, way), way) for way in ways] if port and self.friction else []

    def _units(self, a: Attached) -> dict[str, str]:
        force = friction_unit(self.base)
        own = self._motion_unit() if a in self.ways else _unit(self.base, a.channel) if a.channel else force
        force = own if a.on_lost_motion else force
        driven = {d.signal: d.unit for d in a.drives}
        load = load_unit(self.base, a.drives) or "1"
        position = driven.get("x") or self._motion_unit()
        return {"F": force, "load": load, "x": position, "y": own, "bend": driven.get("bend", "rad")}

    def _motion_unit(self) -> str:
        return _unit(self.base, self.position) or _unit(self.base, "v").removesuffix("/s")

    def _classes(self) -> list[str]:
        left_out = tuple(f for f in MotionParams._fields if not self._own_motion_parameter(f))
        motion_units = {"x": self._motion_unit()}
        inputs = 'joined(__name__, "Inputs", Part("", model_Inputs, None, {}), Part("", Driven, Driven(), {}))'
        lines = [
            *self._driven_class(),
            f"Inputs = {inputs if self.drives else 'model_Inputs'}",
            "Outputs = model_Outputs",
        ]
        lines += ["Params = joined(", "    __name__,", '    "Params",']
        lines += ['    Part("", model_Params, model_Params(), {}),']
        if self.moves:
            lines += [f'    Part("motion__", MotionParams, MotionParams(), {motion_units!r}, {left_out!r}),']
        lines += [
            f'    Part("{a.prefix}", e{n}_Params, e{n}_NEUTRAL, {self._units(a)!r}),'
            for n, a in enumerate(self.attached)
        ]
        lines += [")", "State = joined(", "    __name__,", '    "State",', '    Part("", model_State, None, {}),']
        if self.moves:
            lines += [f'    Part("motion__", Motion, None, {motion_units!r}),']
        for number, a in enumerate(self.attached):
            lines.append(f'    Part("{a.prefix}", e{number}_State, None, {self._units(a)!r}),')
            lines += [f'    Part("{a.prefix}way__", Way, None, {motion_units!r}),'] if a in self.ways else []
        return [*lines, ")"]

    def _driven_class(self) -> list[str]:
        """The inputs that the columns are."""
        if not self.drives:
            return [""]
        lines = ["", "", "class Driven(NamedTuple):"]
        for d in self.drives:
            display = ', display="deg"' if d.unit == "rad" else ""
            quantity = f'Quantity("{d.unit}", "measured {d.column}: {MEANINGS[d.role]}"{display})'
            lines.append(f"    {d.column}: Annotated[float, {quantity}] = {STARTS.get(d.role, 0.0)!r}")
        return [*lines, "", ""]

    def _conditions(self) -> list[str]:
        """Those of the model, whose parameters keep their names here, and of the effects, each on its own part."""
        lines, found = [], ["*model_CONDITIONS"] if hasattr(self.module, "CONDITIONS") else []
        for number, a in enumerate(self.attached):
            if hasattr(a.module, "CONDITIONS"):
                lines += ["", "", f"def e{number}_part(p):", f"    return {self._effect_params(number, a)}"]
                changed = f'what="{a.spec}: " + c.what, part=e{number}_part'
                found.append(f"*(c._replace({changed}) for c in e{number}_CONDITIONS)")
        return [*lines, *(["", "", f"CONDITIONS = ({', '.join(found)},)"] if found else [])]

    # -- expressions

    def _model_params(self) -> str:
        return f"model_Params({', '.join('p.' + f for f in self.module.Params._fields)})"

    def _effect_params(self, number: int, a: Attached) -> str:
        return f"e{number}_Params({', '.join(f'p.{a.prefix}{f}' for f in a.module.Params._fields)})"

    def _own_motion_parameter(self, field: str) -> bool:
        """Tell whether the chain declares a parameter of the coordinates: used, and not the model's already."""
        used = {"x_pre": {"z", "x_pre"}, "tau_v": {"v", "a"}, "tau_a": {"a"}}[field] & self.needs
        measured = {"x_pre": False, "tau_v": not self.position, "tau_a": "a" in self.inputs and not self.position}[
            field
        ]
        return bool(used) and not measured and field not in self.module.Params._fields

    def motion_parameter(self, field: str) -> str:
        if self._own_motion_parameter(field):
            return f"p.motion__{field}"
        return f"p.{field}" if field in self.module.Params._fields else "1.0"  # 1.0: no effect asks for it

    def signals(self, a: Attached, y: str, load: str) -> list[str]:
        """What an effect takes, in the order of its inputs: a number or a field of p, u, m or o."""
        signals = {"y": y, "x": "m.x", "v": "m.v", "a": "m.a", "s": "m.s", "z": "m.z", "load": load}
        if not self.load:
            signals["load"] = "1.0"  # an effect that may be without takes it as one
        signals["x_pre"] = self.motion_parameter("x_pre")
        signals["drive"] = f"{'u' if self.drive in self.inputs else 'o'}.{self.drive}" if self.drive else "0.0"
        signals |= {f: "0.0" for f in a.module.ABOUT.at_outputs if f not in a.takes or not self.load}
        signals |= {d.signal: f"u.{d.column}" for d in a.drives}
        return [signals[f] for f in a.module.Inputs._fields]

    def _call(self, kind: str, number: int, a: Attached, y: str, load: str) -> str:
        inputs = ", ".join(self.signals(a, y, load))
        parameters = self._effect_params(number, a)
        made = f"e{number}_Inputs({inputs})"
        if kind == "start":
            return f"e{number}_start({parameters}, {made})"
        state = ", ".join(f"s.{a.prefix}{f}" for f in a.module.State._fields)
        return f"e{number}_step({parameters}, e{number}_State({state}), {made}, dt)"

    # -- functions

    def _friction_function(self, kind: str) -> list[str]:
        """All friction effects at a given load; separate, because an estimated load is solved for."""
        if not self.friction:
            return []
        arguments = "p, u, m, f, load" if kind == "start" else "p, s, u, m, f, load, dt"
        lines = ["", "", f"def friction_{kind}({arguments}):"]
        for number, a in self.friction:
            lines.append(f"    t{number}, y{number} = {self._call(kind, number, a, 'f', 'load')}")
            lines.append(f"    f = y{number}.y")
        states = ", ".join(f"t{number}" for number, _ in self.friction)
        return [*lines, f"    return ({states},), f"]

    def _function(self, kind: str) -> list[str]:
        lines = ["", "", "def start(p, u):" if kind == "start" else "def step(p, s, u, dt):"]
        lines += [f"    mp = {self._model_params()}"]
        lines += [f"    i_{f} = u.{f}" for f in self.inputs]
        lines += self._motion(kind)
        load = "0.0" if not self.load or self.load_is_output else f"u.{self.load}"
        for number, a in enumerate(self.attached):
            if a in self.ways:
                lines += self._on_way(kind, number, a, load)
            elif a.channel in self.inputs:
                lines.append(f"    t{number}, y{number} = {self._call(kind, number, a, 'i_' + a.channel, load)}")
                lines.append(f"    i_{a.channel} = y{number}.y")
        lines.append(f"    mu = model_Inputs({', '.join('i_' + f for f in self.inputs)})")
        if kind == "start":
            lines.append("    ms, o = model_start(mp, mu)")
        else:
            state = ", ".join(f"s.{f}" for f in self.module.State._fields)
            lines.append(f"    ms, o = model_step(mp, model_State({state}), mu, dt)")
        lines += self._friction_passage(kind)
        if self.load_is_output:
            load = f"o.{self.load}"
        changed = {}
        for number, a in enumerate(self.attached):
            if a.channel and a.channel not in self.inputs:
                y = before = changed.get(a.channel, f"o.{a.channel}")
                changed[a.channel] = f"y{number}.y"
                if a.on_lost_motion:
                    lines.append(f"    l{number} = model_lost_{a.channel}(mp, mu, o) + (o.{a.channel} - {y})")
                    y, changed[a.channel] = f"l{number}", f"x{number}"
                lines.append(f"    t{number}, y{number} = {self._call(kind, number, a, y, load)}")
                if a.on_lost_motion:
                    lines.append(f"    x{number} = {before} - (y{number}.y - l{number})")
        outputs = ", ".join(changed.get(f, f"o.{f}") for f in self.module.Outputs._fields)
        own = {self.load: f"o.{self.load}"} if self.roles.held_load else {}
        if self.slides_later and kind == "step":
            own["slid"] = "slid"
        states = [own.get(f, f"ms.{f}") for f in self.module.State._fields]
        states += [f"m.{f}" for f in Motion._fields] if self.moves else []
        for number, a in enumerate(self.attached):
            states += [f"t{number}.{f}" for f in a.module.State._fields]
            states += [f"w{number}", f"l{number}"] if a in self.ways else []
        return [*lines, f"    return State({', '.join(states)}), Outputs({outputs})"]

    def _on_way(self, kind: str, number: int, a: Attached, load: str) -> list[str]:
        """An effect on the way of the speed as it is so far: the speed of what it leaves of it."""
        speed, before = f"i_{a.channel}", f"s.{a.prefix}way__"
        lines = [
            f"    w{number} = " + ("0.0" if kind == "start" else f"{before}x + {speed}*dt"),
            f"    t{number}, y{number} = {self._call(kind, number, a, f'w{number}', load)}",
            f"    l{number} = w{number} - y{number}.y",
        ]
        if kind == "step":  # a difference of what is lost: where nothing is, the speed stays bit for bit
            lines.append(f"    {speed} = {speed} - (l{number} - {before}lost)/dt")
        return lines

    def _motion(self, kind: str) -> list[str]:
        if not self.moves:
            return ["    m = 0.0  # no effect asks for the motion"]
        position = f"u.{self.position}" if self.position else "0.0"
        if kind == "start":
            speed = "0.0" if self.position else "u.v"
            return [f"    m = Motion({position}, {speed}, 0.0, 0.0, 0.0)"]
        before = f"Motion({', '.join(f's.motion__{f}' for f in Motion._fields)})"
        x_pre, tau_v, tau_a = (self.motion_parameter(f) for f in ("x_pre", "tau_v", "tau_a"))
        if self.position:
            return [f"    m = motion_from_position({before}, {position}, {x_pre}, {tau_v}, {tau_a}, dt)"]
        if "a" in self.inputs:
            return [f"    m = motion_from_speed({before}, u.v, u.a, {x_pre}, dt)"]
        return [
            f"    a = filtered_slope(s.motion__a, s.motion__v, u.v, dt, {tau_a})",
            f"    m = motion_from_speed({before}, u.v, a, {x_pre}, dt)",
        ]

    def _load_function(self, kind: str) -> list[str]:
        """The load at which friction and torque agree, where the load is an output and its friction depends on it."""
        if not self.friction or not self.load_is_output:
            return []
        arguments = "p, u, mp, mu, o, m, f0" if kind == "start" else "p, s, u, mp, mu, o, m, f0, dt"
        before, after = ("p, u, m, f0, ", "") if kind == "start" else ("p, s, u, m, f0, ", ", dt")
        return [
            "",
            "",
            f"def load_{kind}({arguments}):",
            f"    load = model_friction_write(mp, mu, o, f0).{self.load}",
            f"    ft, f = friction_{kind}({before}load{after})",
            "    for _ in range(40):",
            f"        l1 = model_friction_write(mp, mu, o, f).{self.load}",
            "        if abs(l1 - load) <= 1e-14 * (1.0 + abs(l1)):",
            "            return l1, ft, f",
            f"        ft, f = friction_{kind}({before}l1{after})",
            f"        l2 = model_friction_write(mp, mu, o, f).{self.load}",
            "        bend = l2 - 2.0 * l1 + load",
            "        load = l2 if bend == 0.0 else load - (l1 - load) * (l1 - load) / bend  # Aitken",
            f"        ft, f = friction_{kind}({before}load{after})",
            '    raise ValueError("no load fits: the friction grows faster than the load")',
        ]

    def _friction_passage(self, kind: str) -> list[str]:
        if not self.friction:
            return []
        before, after = ("p, u, ", "") if kind == "start" else ("p, s, u, ", ", dt")
        lines = ["    f0 = model_friction_read(mp, mu, o)"]
        if self.load_is_output:
            lines.append(f"    load, ft, f = load_{kind}({before}mp, mu, o, m, f0{after})")
        else:
            load = f"u.{self.load}" if self.load else "0.0"
            lines.append(f"    ft, f = friction_{kind}({before}m, f0, {load}{after})")
        lines += ["    if f != f0:", "        o = model_friction_write(mp, mu, o, f)"]
        if self.roles.held_load and kind == "step":
            lines += (self._slides() if self.slides_later else []) + self._holding()
        return [*lines, *(f"    t{number} = ft[{place}]" for place, (number, _) in enumerate(self.friction))]

    def _slides(self) -> list[str]:
        """Whether the friction slides, that of the effects too: from then on the load is known.

        Theirs may be nothing at the load of the moment and much at the next: what counts is how far the motion went.
        """
        sizes = [(a, name) for _, a in self._building_up() for name in sizes_of(a.module)]
        some = " or ".join(f"p.{a.prefix}{name} != {getattr(a.module.NEUTRAL, name)!r}" for a, name in sizes)
        return [
            "    slid = ms.slid",
            f"    if s.slid == 0.0 and abs(m.z) < {SLIDING_SHARE} and ({some}):",
            "        slid = 0.0",
        ]

    def _holding(self) -> list[str]:
        """The load between the two frictions of sliding, kept as long as it can be; states are those of release."""
        ways = (f"Motion(m.x, m.v, m.a, {sign}, {sign})" for sign in ("1.0", "-1.0")) if self.moves else ("m", "m")
        pull, release = ways
        return [
            "    if p.hold == 1 and s.slid == 1.0:",
            "        level = model_load_level(mp, ms.v_in)",
            f"        lo, ft, f = load_step(p, s, u, mp, mu, o, {pull}, level, dt)",
            f"        hi, ft, f = load_step(p, s, u, mp, mu, o, {release}, -level, dt)",
            f"        held = model_load_between(s.{self.load}, lo, hi)",
            "        o = model_load_write(mp, mu, o, held)",
        ]


def acts_on_way(base: Kernel, a: Attached) -> bool:
    """Whether an effect of a position acts on the way that belongs to the model's speed."""
    return a.channel == base.motion == "v" and a.module.ABOUT.motion_only


def imported(function: Any, name: str) -> str:
    """Import of a function of a model, from the file that it is written in, under another name."""
    return f"from .{function.__module__.partition('.models.')[2]} import {function.__name__} as {name}"


def adds_load(module: ModuleType) -> bool:
    """Whether an effect's law adds the load to the friction: its file says so by the load's unit."""
    return any(v.name == "load" and v.quantity.unit == "{F}" for v in variables(module.Inputs))


def load_unit(base: Kernel, drives: Sequence[Drive]) -> str:
    """Unit of the load that an effect sees: of a column of the log, else of the model's own; '' without one."""
    return next((d.unit for d in drives if d.signal == "load"), "") or _unit(base, base.roles.load or "")


def friction_unit(base: Kernel) -> str:
    """Unit of a model's friction; '' without one."""
    return _unit(base, base.roles.friction.like) if base.roles.friction else ""


def _unit(base: Kernel, name: str) -> str:
    for v in (*base.inputs, *base.outputs):
        if v.name == name:
            return v.quantity.unit
    return ""
