import 'vesicle/element';
