/** Views in the page: they are functions of state, rendered by Preact when a signal that they read changes. */
import { type ComponentChild, type FunctionComponent, render } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';

/** Renders a view of a single element, and returns that. */
export function elementOf(view: ComponentChild): HTMLElement {
  const holder = document.createElement('div');
  render(view, holder);
  const { firstElementChild } = holder;
  if (!(firstElementChild instanceof HTMLElement)) throw new Error('a view without an element');
  return firstElementChild;
}

/** An element that is made elsewhere, such as a canvas, as a part of a view. */
export function Made({ of }: { of: HTMLElement }) {
  const holder = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => holder.current?.replaceChildren(of), [of]);
  return <div class="made" ref={holder} />;
}

/** Returns a component that is rendered again only when one of its properties is another. */
export function kept<Props extends object>(view: FunctionComponent<Props>): FunctionComponent<Props> {
  return function Kept(this: { shouldComponentUpdate: (next: Props) => boolean; props: Props }, props: Props) {
    this.shouldComponentUpdate = (next) => differ(this.props, next);
    const View = view;
    return <View {...props} />;
  } as FunctionComponent<Props>;
}

function differ(before: object, after: object): boolean {
  const given: Record<string, unknown> = { ...before };
  return Object.entries(after).some(([name, value]) => !Object.is(given[name], value));
}
