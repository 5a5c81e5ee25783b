"""Boolean functions in canonical form: reduced ordered binary decision diagrams.

A function is an int. Two functions over the same variables are equal exactly when their ints are,
which is what makes the set of residual formulas finite and comparable (Bryant 1986).

Variables can form a chain, in which each implies all that are below it: `F[<=3] p` implies
`F[<=4] p`. Functions that differ only where that is broken are the same function.
"""

from __future__ import annotations

from collections.abc import Callable

FALSE = 0
TRUE = 1
_LEAF_LEVEL = 1 << 30  # below every variable

Cube = tuple[tuple[int, bool], ...]  # a conjunction of (level, is it positive?)


class Bdd:
    """A store of diagrams over variables that are numbered by level, 0 at the top.

    Args:
        on_growth: called for every new node; raises to stop a computation that grew too long.
    """

    def __init__(self, on_growth: Callable[[], None]) -> None:
        self.level = [_LEAF_LEVEL, _LEAF_LEVEL]
        self.low = [FALSE, TRUE]  # the leaves are their own cofactors
        self.high = [FALSE, TRUE]
        self._chain_end: dict[int, int] = {}  # by level, one past the last of its chain
        self._on_growth = on_growth
        self._cubes_left = 0  # while a cover is computed
        self._nodes: dict[tuple[int, int, int], int] = {}
        self._choices: dict[tuple[int, int, int], int] = {}

    def chain(self, levels: range) -> None:
        """Let each of some consecutive variables imply all that are below it."""
        self._chain_end.update(dict.fromkeys(levels, levels.stop))

    def variable(self, level: int) -> int:
        """The function that is true where the variable is."""
        return self._node(level, FALSE, TRUE)

    def negation(self, f: int) -> int:
        """Not f."""
        return self.choice(f, FALSE, TRUE)

    def both(self, f: int, g: int) -> int:
        """The conjunction of f and g."""
        return self.choice(f, g, FALSE)

    def either(self, f: int, g: int) -> int:
        """The disjunction of f and g."""
        return self.choice(f, TRUE, g)

    def choice(self, f: int, g: int, h: int) -> int:
        """If f then g else h."""
        if f == TRUE or g == h:
            return g
        if f == FALSE:
            return h
        if g == TRUE and h == FALSE:
            return f
        key = (f, g, h)
        found = self._choices.get(key)
        if found is None:
            level = min(self.level[f], self.level[g], self.level[h])
            low = self.choice(*(self.cofactor(x, level, False) for x in key))
            high = self.choice(*(self.cofactor(x, level, True) for x in key))
            found = self._choices[key] = self._node(level, low, high)
        return found

    def cofactor(self, f: int, level: int, value: bool) -> int:
        """The function f with a variable fixed; no variable of f may lie above that one."""
        if self.level[f] == level:
            return self.high[f] if value else self.low[f]
        return self.high[f] if value and self.level[f] < self._chain_end.get(level, 0) else f

    def substitute(self, f: int, image: Callable[[int], int], memo: dict[int, int]) -> int:
        """The function f with every variable replaced by a function.

        Args:
            f: a function.
            image: gives the replacement for the variable of a level.
            memo: results of earlier calls with the same replacements; extended.
        """
        if f in (FALSE, TRUE):
            return f
        found = memo.get(f)
        if found is None:
            low = self.substitute(self.low[f], image, memo)
            high = self.substitute(self.high[f], image, memo)
            found = memo[f] = self.choice(image(self.level[f]), high, low)
        return found

    def given(self, f: int, level: int, value: bool) -> int:
        """The function f with the variable of any level fixed."""

        def image(other: int) -> int:
            return int(value) if other == level else self.variable(other)

        return self.substitute(f, image, {})

    def cover(self, f: int, most: int) -> list[Cube] | None:
        """Cubes whose disjunction is f, none of them superfluous (Minato 1993).

        Args:
            f: a function.
            most: number of cubes; None is the answer if there are more.
        """
        self._cubes_left = most
        cubes, _ = self._cover(f, f)
        return cubes if self._cubes_left >= 0 else None

    def _cover(self, lower: int, upper: int) -> tuple[list[Cube], int]:
        """An irredundant cover of some function between two bounds, and that function."""
        if lower == FALSE or self._cubes_left < 0:
            return [], FALSE
        if upper == TRUE:
            self._cubes_left -= 1
            return [()], TRUE
        level = min(self.level[lower], self.level[upper])
        lower0, lower1 = (self.cofactor(lower, level, value) for value in (False, True))
        upper0, upper1 = (self.cofactor(upper, level, value) for value in (False, True))
        # What only one side of the variable may hold needs the literal; the rest does without.
        cubes0, f0 = self._cover(self.both(lower0, self.negation(upper1)), upper0)
        cubes1, f1 = self._cover(self.both(lower1, self.negation(upper0)), upper1)
        rest = self.either(
            self.both(lower0, self.negation(f0)), self.both(lower1, self.negation(f1))
        )
        cubes, f = self._cover(rest, self.both(upper0, upper1))
        found = [((level, False), *cube) for cube in cubes0]
        found += [((level, True), *cube) for cube in cubes1] + cubes
        variable = self.variable(level)
        return found, self.choice(variable, self.either(f1, f), self.either(f0, f))

    def _node(self, level: int, low: int, high: int) -> int:
        if low == high:
            return low
        if self.high[low] == high and self.level[low] < self._chain_end.get(level, 0):
            return low
        key = (level, low, high)
        found = self._nodes.get(key)
        if found is None:
            self._on_growth()
            found = self._nodes[key] = len(self.level)
            self.level.append(level)
            self.low.append(low)
            self.high.append(high)
        return found
