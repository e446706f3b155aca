"""What a fit may change: start, bounds and role of every parameter of a model, as one immutable value.

A `SearchSpace` never changes; each method returns another one. `SearchSpace.from_lmfit` and `SearchSpace.to_lmfit`
are the border to lmfit, in whose ``Parameters`` results are shown.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lmfit import Parameters


@dataclass(frozen=True)
class SearchParameter:
    """One parameter of a fit, in SI.

    Attributes
    ----------
    start : float
        Value that the search starts from; of a parameter that is not free, its value.
    lo, hi : float
        Bounds that the search keeps; may be infinite.
    free : bool
        Whether the fit changes it.
    per_run : bool
        Whether each run has a value of its own (an offset, an initial state) or all runs share one.
    """

    start: float
    lo: float
    hi: float
    free: bool = True
    per_run: bool = False

    def starting_at(self, value: float) -> SearchParameter:
        """A copy with another start, moved into the bounds."""
        return replace(self, start=min(max(value, self.lo), self.hi))

    def within(self, lo: float, hi: float) -> SearchParameter:
        """A copy with bounds that are no wider than these, the start moved into them."""
        lo, hi = min(max(self.lo, lo), self.hi), max(min(self.hi, hi), self.lo)
        return replace(self, lo=lo, hi=hi).starting_at(self.start)


@dataclass(frozen=True)
class SearchSpace:
    """All parameters of a fit.

    Attributes
    ----------
    parameters : mapping of str to SearchParameter
        By Python field name, in the order of the kernel's ``Params``.
    """

    parameters: Mapping[str, SearchParameter]

    def __getitem__(self, field: str) -> SearchParameter:
        return self.parameters[field]

    def __contains__(self, field: object) -> bool:
        return field in self.parameters

    @cached_property
    def shared(self) -> tuple[str, ...]:
        """Free fields with one value for all runs."""
        return tuple(f for f, p in self.parameters.items() if p.free and not p.per_run)

    @cached_property
    def per_run(self) -> tuple[str, ...]:
        """Free fields with one value for each run."""
        return tuple(f for f, p in self.parameters.items() if p.free and p.per_run)

    @property
    def free(self) -> tuple[str, ...]:
        """All free fields, the shared ones first."""
        return (*self.shared, *self.per_run)

    def with_parameter(self, field: str, parameter: SearchParameter) -> SearchSpace:
        """A copy with one parameter replaced."""
        return SearchSpace({**self.parameters, field: parameter})

    def with_bounds(self, field: str, lo: float | None = None, hi: float | None = None) -> SearchSpace:
        """A copy with other bounds of one parameter; an end that is not given stays."""
        old = self.parameters[field]
        lo, hi = old.lo if lo is None else lo, old.hi if hi is None else hi
        return self.with_parameter(field, replace(old, lo=lo, hi=hi).starting_at(old.start))

    def starting_at(self, values: Mapping[str, float]) -> SearchSpace:
        """A copy with other start values, by field."""
        moved = {f: self.parameters[f].starting_at(float(value)) for f, value in values.items()}
        return SearchSpace({**self.parameters, **moved})

    def fixing(self, fields: Iterable[str]) -> SearchSpace:
        """A copy with these fields no longer free."""
        return SearchSpace({**self.parameters, **{f: replace(self.parameters[f], free=False) for f in fields}})

    def freeing_only(self, fields: Collection[str]) -> SearchSpace:
        """A copy with these fields free and no other."""
        return SearchSpace({f: replace(p, free=f in fields) for f, p in self.parameters.items()})

    def with_per_run(self, fields: Collection[str]) -> SearchSpace:
        """A copy with one value for each run of these fields and of no other."""
        return SearchSpace({f: replace(p, per_run=f in fields) for f, p in self.parameters.items()})

    @classmethod
    def from_lmfit(cls, parameters: Parameters, per_run: Collection[str] = ()) -> SearchSpace:
        """From lmfit's parameters by field name: value, min, max and vary.

        Parameters
        ----------
        parameters : lmfit.Parameters
        per_run : collection of str
            Fields with one value for each run.
        """
        return cls(
            {
                name: SearchParameter(float(p.value), float(p.min), float(p.max), bool(p.vary), name in per_run)
                for name, p in parameters.items()
            }
        )

    def to_lmfit(self) -> Parameters:
        """The parameters as those of lmfit, by field."""
        from lmfit import Parameters  # brings Matplotlib: only results in its form pay for that

        parameters = Parameters()
        for field, p in self.parameters.items():
            parameters.add(field, value=p.start, vary=p.free, min=p.lo, max=p.hi)
        return parameters
