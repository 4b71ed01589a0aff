"""From tasks to orders: one plan for each kind of task, for every team in the order of the file."""

from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any

from proving_ground.scenario.drills import begun, plan_bound, plan_clear, plan_follow, plan_stack_up
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.group import Group, Walker
from proving_ground.scenario.moves import (
    plan_form,
    plan_gather,
    plan_hold,
    plan_lift,
    plan_move,
    plan_stairs,
    plan_turn,
    plan_wait,
)
from proving_ground.scenario.orders import Await, Note, OrderBook
from proving_ground.scenario.schema import tasks
from proving_ground.scenario.schema.tasks import Follow, Repeat, Task
from proving_ground.scenario.site_builder import known

_Plan = Callable[[Group, Any, list[Walker], str], None]
_PLANS: dict[type, _Plan] = {
    tasks.Walk: plan_move,
    tasks.Run: plan_move,
    tasks.Sprint: plan_move,
    tasks.Crawl: plan_move,
    tasks.SideStep: plan_move,
    tasks.Backward: plan_move,
    tasks.Stand: plan_hold,
    tasks.Kneel: plan_hold,
    tasks.Prone: plan_hold,
    tasks.TakeStairs: plan_stairs,
    tasks.TakeLift: plan_lift,
    tasks.Turn: plan_turn,
    tasks.Wait: plan_wait,
    tasks.Gather: plan_gather,
    tasks.StackUp: plan_stack_up,
    tasks.Clear: plan_clear,
    tasks.Bound: plan_bound,
    tasks.Form: plan_form,
}
_MOST_ORDERS = 300_000
_SHOWN_KEYS = ("to", "room", "door", "by", "until", "soldier")


def plan_all(groups: Iterable[Group], book: OrderBook) -> None:
    """Orders for everybody; a fault at the first task that cannot be done."""
    planned: dict[str, tuple[Group, Walker]] = {}
    for group in groups:
        for walker in group.walkers:
            group.stay(walker, "stand", 0.0, group.team.start_s)
        for index, task in enumerate(group.team.tasks):
            plan_task(group, task, f"{group.key}.tasks[{index}]", planned)
        planned |= {walker.id: (group, walker) for walker in group.walkers}
    _complete_labels(book, {walker.id: group.unit for group, walker in planned.values()})


def plan_task(group: Group, task: Task, key: str, others: dict[str, tuple[Group, Walker]]) -> None:
    """One task, with its marks."""
    walkers = group.chosen(task, key)
    if group.book.count > _MOST_ORDERS:
        raise ScenarioFault(key, f"the tasks come to more than {_MOST_ORDERS} steps: repeat less")
    if isinstance(task, Repeat):
        for _ in range(task.times):
            for index, inner in enumerate(task.tasks):
                plan_task(group, inner, f"{key}.tasks[{index}]", others)
    else:
        group.note(walkers, describe(task, group), key)
        group.task_name = group.named(task.name)
        for walker in walkers if task.name else ():
            group.mark([walker], begun(group.label(task.name), walker.id))
        if isinstance(task, Follow):
            plan_follow(group, task, walkers, key, others)
        else:
            _PLANS[type(task)](group, task, walkers, key)
    if task.name:
        group.mark(walkers, group.label(task.name))


def describe(task: Task, group: Group) -> str:
    """A task in a few words: ``walk to kitchen``."""
    verb = str(type(task).__struct_config__.tag).replace("_", " ")
    for name in _SHOWN_KEYS:
        value = getattr(task, name, None)
        if isinstance(value, str):
            return f"{verb} {'to ' if name == 'to' else ''}{group.named(value)}"
        if isinstance(value, tuple):
            return f"{verb} to [{value[0]:g}, {value[1]:g}]"
    return verb


def _complete_labels(book: OrderBook, unit_of: dict[str, str]) -> None:
    """Every `Await` gets its label in full: the own unit's, or the only other unit's with a task of that name."""
    by_name: dict[str, list[str]] = defaultdict(list)
    for label in book.marks:
        by_name[label.partition("/")[2]].append(label)
    for soldier, orders in book.orders.items():
        key = ""
        for index, order in enumerate(orders):
            if isinstance(order, Note):
                key = order.key
            if isinstance(order, Await) and order.label not in book.marks:
                label = _label(order.label, unit_of[soldier], book, by_name, f"{key}.until")
                orders[index] = Await(label, order.after_s, order.posture)


def _label(name: str, unit: str, book: OrderBook, by_name: dict[str, list[str]], key: str) -> str:
    if f"{unit}/{name}" in book.marks:
        return f"{unit}/{name}"
    names = [label for label in {*by_name, *book.marks} if " begun by " not in label]
    known(name, names, key, "task named")
    if len(by_name[name]) > 1:
        raise ScenarioFault(key, f"several units have a task {name!r}; say which: {', '.join(by_name[name])}")
    return by_name[name][0]
